//! Parse, dispatch, one error line, exit code.

#![forbid(unsafe_code)]

fn main() -> std::process::ExitCode {
    taki::cli::main()
}
