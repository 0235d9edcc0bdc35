"""What a description lacks or has wrong, written into it: by `twin diagnose` and by `twin hide`."""
