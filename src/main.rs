//! The `halflight` program: everything is in the library's `cli`.

fn main() -> std::process::ExitCode {
    halflight::cli::main()
}
