"""One script per consumer of what `twin export` writes. They know nothing of `twin`: copy them."""
