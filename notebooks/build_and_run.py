# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Build and run
#
# From the description of a machine tool to the displacement of its tool, step by step: what `twin build` and
# `twin run` do inside. The machine is the shipped five-axis machining centre; the load is experiment A of Dehn
# et al. (2023): X moves for 4 h at constant speed, then the machine rests for 8 h.
#
# To be quick, only two held-out scenarios are stepped, where `twin build` and `twin verify` take 19.

# %%
import numpy as np

import twin

# %% [markdown]
# ## The description
#
# `machine.toml` names everything that physics happens in. Parts joined by fixed contacts form *bodies*; bodies
# meet only in moving contacts: carriages on rails, nuts on screws.

# %%
machine = twin.load("models/five_axis")
described = machine.description
print(f"{machine.name}: {described.machine.description}")
for body, parts in machine.bodies.items():
    print(f"  body {body}: {', '.join(parts)}")
for name, axis in described.axes.items():
    print(f"  axis {name} ({axis.kind}) carries {', '.join(axis.carries)}")
print(f"  {len(described.sources)} sources, {len(described.films)} films, {len(described.sensors)} sensors")

# %% [markdown]
# ## The model
#
# The full model has quadratic tetrahedra, one thermal system per body, and the elastic flexibility of each body at
# its interfaces. The position of the axes is in none of these matrices: it only decides which segments of a rail
# face a carriage. Each body's equations are projected on a rich basis, and that is compressed by what coupled runs
# of drawn loads excite.
#
# What is left is the model. Saved as an artefact it holds the compact equations, their certificate, the laws with
# their parameters and the description itself.

# %%
options = twin.BuildOptions(held_out=2)
model = twin.build(machine, options=options)
for body, states in model.bodies.items():
    print(f"  {body}: {states} states")
print(f"{model.provenance['full_states']} temperatures became {model.states} states")

# %% [markdown]
# ## The run
#
# Losses and film coefficients are evaluated at every sample of the load log and averaged to steps of one
# minute. Each step also gives the TCP displacement at all 125 poses.

# %%
result = model.run("models/five_axis/runs/experiment_a")
print(f"heat balance closes to {result.balance_error:.0e} of the throughput")
result.plot.temperatures()

# %% [markdown]
# The vertical axis heats even at rest, because its motor holds the weight of the headstock.

# %%
result.plot.tcp()

# %%
result.plot.surface()

# %% [markdown]
# ## The workspace
#
# The volumetric error splits into a shift, a linear part and the rest. Paper 000 found mostly a shift.

# %%
result.plot.workspace()

# %% [markdown]
# The numbers have named dimensions and units (xarray).

# %%
print(result.tcp.sel(component="z").max("time").isel(y=2, z=2))

# %% [markdown]
# ## Is it right?
#
# Three checks: heat in = out + stored; the compact against the rich model on scenarios that neither the
# training nor the build has seen; and the size of the displacement, which paper 000 measured as 38 µm on its
# machine.

# %%
unseen = model.verify(full=0, options=options).certificate
temperature_error, displacement_error = np.max(unseen["temperature_error"]), np.max(unseen["displacement_error"])
temperature_range, displacement_range = np.max(unseen["temperature_range"]), np.max(unseen["displacement_range"])
print("compact against rich, unseen loads:")
print(f"  temperature {temperature_error:.3f} K at ranges up to {temperature_range:.0f} K")
print(f"  TCP displacement {1e6 * displacement_error:.2f} µm at ranges up to {1e6 * displacement_range:.0f} µm")
largest = 1e6 * float(abs(result.tcp).max())
print(f"largest TCP displacement in experiment A: {largest:.1f} µm")

assert result.balance_error < 1e-8
assert temperature_error < 0.01 * temperature_range
assert displacement_error < 0.01 * displacement_range
assert 15.0 < largest < 100.0
