//! The `taki` program: [`taki::cli::main`] parses the command line, runs the command and returns its exit
//! code.

fn main() -> std::process::ExitCode {
    taki::cli::main()
}
