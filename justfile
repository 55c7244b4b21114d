# `just` lists the recipes. What they do is written once, in .ci/run; they use the tools of
# the environment that is active.

# List the recipes.
default:
    @just --list

# Install the checkout, with all tools, into the active environment.
setup:
    python -m pip install -c constraints.txt -e '.[test]'

# Lint, types and import contracts: half a minute.
check: (step "lint") (step "types") (step "contracts")

# Run the tests, or those that are named: `just test tests/planners`.
test *ARGS:
    pytest -q -n auto {{ ARGS }}

# Build the documentation into build/site; broken links are errors.
docs: (step "docs")

# Run one step of .ci/run.
step NAME:
    bash .ci/run {{ NAME }}

# Run all tests and measure how much of the code they cover.
coverage: (step "coverage")

# Everything, in an environment of its own, as the hosted checks do.
ci:
    bash .ci/run
