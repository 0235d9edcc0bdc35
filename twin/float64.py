"""Double precision for JAX: import this before any JAX array is made.

`twin.physics` and `twin.run` do so on import. Energy balances to 1e-8 are out of reach of JAX's default float32.
"""

from __future__ import annotations

import jax

jax.config.update("jax_enable_x64", True)
