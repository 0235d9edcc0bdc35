"""The solve of a step of the probed model, and how it changes with what its matrix is made of.

S = c + P Gamma P^T,    c = A0 + sum c_k A_k
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
from jax.scipy.linalg import cho_solve

from twin.rom.contact_matrix import ContactEntries, ContactPlaces, product, scaled


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Fixed:
    """What derivatives of a solve take as it is."""

    factor: jax.Array  # (r, r) Cholesky factor of S = c + P Gamma P^T
    terms: jax.Array  # (q, r, r), many: c is their combination
    products: jax.Array | None  # (q + n_contacts, r) `products_of` the solution, where they have been made
    contacts: ContactEntries
    P: jax.Array  # (r, n_ports)


def by_factor(fixed: Fixed, right: jax.Array, near: jax.Array) -> jax.Array:
    """S^-1 right (r,)."""
    return jnp.asarray(cho_solve((fixed.factor, True), right))


def change_of(places: ContactPlaces, fixed: Fixed, d: tuple[jax.Array, jax.Array], x: jax.Array) -> jax.Array:
    """S' x by c, (r, r) or (q,) of the terms, and by the contacts' factors.

    Few derivatives: a matrix dc for each, made once. Many: the products of terms with the solution, which they share.
    The other way about, either takes several times as long.
    """
    dc, dcontact = d
    if not len(fixed.terms):
        return dc @ x + _across(places, fixed.P, fixed.contacts, dcontact, x)
    known = fixed.products
    products = products_of(places, fixed.terms, fixed.P, fixed.contacts, x) if known is None else known
    return jnp.concatenate([dc, dcontact]) @ products


def _across(
    places: ContactPlaces, P: jax.Array, contacts: ContactEntries, factor: jax.Array, x: jax.Array
) -> jax.Array:
    """P Gamma P^T x (r,) of a step, its contacts times factors (n_contacts,)."""
    flow = product(jnp, places, scaled(jnp, places, contacts, factor), (P.T @ x)[:, None])[:, 0]
    return jnp.asarray(P @ flow)


def products_of(
    places: ContactPlaces, terms: jax.Array, P: jax.Array, contacts: ContactEntries, x: jax.Array
) -> jax.Array:
    """(q + n_contacts, r) of x (r,) with each of the terms, then with each contact of a step."""
    one = partial(_across, places, P, contacts)
    return jnp.concatenate([terms @ x, jax.vmap(lambda factor: one(factor, x))(jnp.eye(places.n_contacts))])
