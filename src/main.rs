//! Parse, dispatch, one error line, exit code.

fn main() -> std::process::ExitCode {
    taki::cli::main()
}
