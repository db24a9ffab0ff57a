//! The command line of tapjoint: arguments in, exit code out. Everything else is in the library.

fn main() -> std::process::ExitCode {
    tapjoint::cli::run(std::env::args_os()).into()
}
