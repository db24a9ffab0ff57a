#!/bin/sh
# Calls the compiler, RUSTC_WRAPPER of the fuzz build. Only in crates that read text or files are the operands of
# comparisons traced: in numerical ones that costs a third of the time and finds nothing.
case " $* " in
    *" --crate-name tapjoint_signal "* | *" --crate-name tapjoint_description "* | *" --crate-name tapjoint_study "* \
        | *" --crate-name serde_json "* | *" --crate-name toml"*)
        exec "$@" -Cllvm-args=-sanitizer-coverage-trace-compares ;;
    *) exec "$@" ;;
esac
