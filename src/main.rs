//! The binary: parses the command line, calls the library, maps the outcome to an exit status.

fn main() -> std::process::ExitCode {
    beamsim::cli::main()
}
