# Daily commands. just (https://just.systems) is optional: each recipe is a line or two that you can type yourself.
# Everything that must pass before a change is merged is in .ci/run.

beamsim := env("CARGO_TARGET_DIR", "target") / "release/beamsim"

# List the recipes
default:
    @just --list

# Build the program
build:
    cargo build --release

# Run all tests
test:
    cargo test --release --locked

# Run the tests whose names contain NAME, for example joints::
test-one NAME:
    cargo test --release --test suite {{NAME}}

# Read, check and run many wrong and odd inputs (docs/reliability.md)
fuzz SEED='1' INPUTS='1000000' RUNS='10000':
    cargo test --release --locked --test fuzz -- --seed {{SEED}} --inputs {{INPUTS}} --runs {{RUNS}}

# Compile everything and run the unit tests in src/ and core/src/
quick:
    cargo check --all-targets
    cargo test --release --lib

# Check format and lints
lint:
    cargo fmt --all --check
    cargo clippy --release --locked --all-targets --all-features -- -D warnings

# Run the commands in docs/, check links, and build the API documentation
docs: build
    python3 tests/book/run.py --beamsim {{beamsim}}
    RUSTDOCFLAGS="-D warnings" cargo doc --release --locked --no-deps

# Run decks and compare the results with their [[expect]] tables
verify *DECKS='decks': build
    {{beamsim}} verify {{DECKS}}

# Run the benchmarks and count instructions
bench:
    cargo bench --locked --bench kernels
    cargo bench --locked --bench scaling
    python3 benches/instructions.py

# Put known mistakes into copies of the sources: each must make a test fail
mutations *NAMES:
    python3 tests/mutations/run.py {{NAMES}}

# Run everything that must pass before a change is merged
ci:
    .ci/run

# Kill runs at random, run pairs into one folder, fill disks, send signals (docs/reliability.md)
reliability KILLS='500' PAIRS='200':
    python3 tests/reliability/kills.py --beamsim {{beamsim}} --kills {{KILLS}} --pairs {{PAIRS}}
    python3 tests/reliability/signals.py {{beamsim}}
