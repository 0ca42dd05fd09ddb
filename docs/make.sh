#!/usr/bin/env bash
# Makes the figures and tables of docs/ and README.md again with a built program.
#
#   docs/make.sh list                  what there is to make, and what makes it
#   docs/make.sh check                 every file that the pages name is there; needs no program
#   docs/make.sh figures [WORD ...]    figures whose command holds all the words: every one takes some ten minutes
#   docs/make.sh NAME ...              tables: their text goes to stdout, for eyes and for diff
#
# HALFLIGHT names the program (default target/release/halflight; `cargo build --release` makes it).
#
# The commands of figures stand beside the figures, in README.md and docs/*.md: whatever of the form
# `halflight ... --out docs` or `cargo run ... --example ... --out docs` is found there is run, and of the files that it
# writes those that docs/ already has are replaced. So a page cannot name one command and a figure come from another.
#
# Not made here: tables that need what is not in this repository (Mitsuba's references: benches/against_mitsuba.py says
# what it needs; the three rooms; the scenes of many lamps).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
program="${HALFLIGHT:-target/release/halflight}"
scratch=""
trap '[ -z "$scratch" ] || rm -rf "$scratch"' EXIT

fail() { printf '%s\n' "$*" >&2; exit 1; }

# Runs the program, saying how.
run() { printf '\n$ halflight %s\n' "$*"; "$program" "$@"; }

# The commands of figures, one a line, without `--out docs`.
figure_commands() {
    grep -ohE '(halflight [a-z]|cargo run [^`]*--example )[^`]* --out docs' README.md docs/*.md | sed 's/ --out docs$//' | sort -u
}

figures() {
    local command word words picture
    while read -r command; do
        for word in "$@"; do
            case " $command " in *" $word "*) ;; *) continue 2 ;; esac
        done
        scratch="$(mktemp -d)"
        printf '\n$ %s\n' "$command"
        read -ra words <<<"$command"
        [ "${words[0]}" != halflight ] || words[0]="$program"
        "${words[@]}" --out "$scratch" </dev/null
        for picture in "$scratch"/*.png; do
            if [ -e "docs/${picture##*/}" ]; then
                cp "$picture" docs/
                echo "made docs/${picture##*/}"
            fi
        done
        rm -rf "$scratch"
    done < <(figure_commands)
}

# What README.md and commands.md show of the commands.
outputs() {
    local out
    scratch="$(mktemp -d)"; out="$scratch"
    run render --size 256x256 --out "$out"
    run bounces --mode global --out "$out"
    run trace --mode global --size 256x256 --samples 64 --out "$out"
    run map furnished-room --out "$out"
    run factors docs/squares.obj --out "$out"
    run render --mode global --size 64x64 -o "$out/cornell.exr"
    run diff "$out/cornell.exr" tests/data/cornell/reference.exr --out "$out"
    run scenes
    rm -rf "$scratch"
}

# Error asked for, stated and reached: validation.md, "Asked and reached", and frontier.md's table.
accuracy() {
    local scene mode
    scratch="$(mktemp -d)"
    for scene in cornell-box two-rooms concentric-spheres furnished-room; do
        for mode in global one-bounce local; do
            run chart "$scene" --mode "$mode" --ladders tolerance --size 256x256 --time 40 --out "$scratch"
        done
    done
    rm -rf "$scratch"
}
frontier() {
    scratch="$(mktemp -d)"
    cargo run --release --example frontier -- furnished-room --formal --trace --out "$scratch"
    rm -rf "$scratch"
}

# Whether five methods agree: validation.md, "Five methods against each other".
agreement() {
    local scene
    scratch="$(mktemp -d)"
    for scene in cornell-box furnace concentric-spheres furnished-room two-rooms tests/data/hybrid/hybrid.toml; do
        run compare "$scene" --size 64x64 --time 4 --out "$scratch" || echo "(a mode that diverges ends with code $?)"
    done
    rm -rf "$scratch"
}

# Memory predicted: the message of a refusal has it.
memory() {
    local case size mode patches rays
    for case in "global 8000 256" "global 24000 256" "shadowless 12000 512"; do
        read -r mode patches rays <<<"$case"
        run render furnished-room --mode "$mode" --patches "$patches" --rays "$rays" --size 8x8 --memory 0.001 2>&1 | grep -iE '^\$|patches need' || true
    done
    for size in 256 512; do
        run map furnished-room --patches 16000 --rays "$size" --memory 0.001 2>&1 | grep -iE '^\$|patches need' || true
    done
}

# The order of convergence in patch size, on which ORDER of solved.rs rests (theory.md, section 14).
constants() {
    local patches
    scratch="$(mktemp -d)"
    run trace furnished-room --mode global --size 64x64 --samples 2048 -o "$scratch/traced.exr"
    for patches in 250 1000 4000 16000; do
        run render furnished-room --mode global --size 64x64 --patches "$patches" --rays 1024 --samples 512 \
            -o "$scratch/patches.exr"
        run diff "$scratch/patches.exr" "$scratch/traced.exr" --out "$scratch" | grep 'mean difference'
    done
    rm -rf "$scratch"
}

# Tables that cargo makes.
truths() { cargo test; }
factors() { cargo test --test all factors:: -- --nocapture; }
paper() { cargo bench --bench paper_setting; }
readers() { HALFLIGHT_INPUTS="${HALFLIGHT_INPUTS:-10000000}" cargo test --test readers -- --ignored --nocapture; }

# Files that links name, and paths in code quotes, are there.
check() {
    local page target missing=0
    for page in README.md CONTRIBUTING.md CHANGELOG.md SECURITY.md CODE_OF_CONDUCT.md docs/*.md docs/book/*.md; do
        while read -r target; do
            [ -e "$target" ] || { echo "$page names $target, which is not there"; missing=1; }
        done < <(
            # Links count from their page, paths in code quotes from the root.
            grep -oE '\]\([^)# ]+' "$page" | sed 's/^](//' | grep -v '^http' | sed "s|^|$(dirname "$page")/|" || true
            grep -oE '`(src|crates|tests|benches|docs|meshes|examples)/[A-Za-z0-9_./-]+`' "$page" | tr -d '`' || true
        )
    done
    [ "$missing" = 0 ] || fail "mend the pages named above"
    echo "every file that the pages name is there"
}

list() {
    echo "figures: some ten minutes each for compare, chart and frontier, some seconds for the others"
    figure_commands | sed 's/^/  /'
    cat <<'END'
tables:
  outputs     what README.md and commands.md show                   some seconds
  accuracy    errors asked for, stated and reached                  twelve charts of one to two minutes
  agreement   whether five methods agree                            some minutes a scene
  frontier    both sides of the frontier, in numbers                some minutes
  memory      memory predicted for K                                some seconds
  constants   order of convergence in patch size                    a minute or two
  truths      cargo test                                            see CONTRIBUTING.md
  factors     60 exact form factors                                 seconds, and compiling
  paper       the samples that the paper's setting needs            a minute, and compiling
  readers     ten million texts that are almost scenes              a minute, and compiling
END
}

[ $# -gt 0 ] || { list; exit 0; }
case "$1" in
    list | check | frontier | truths | factors | paper | readers) ;;
    *) [ -x "$program" ] || fail "there is no program at $program: cargo build --release, or set HALFLIGHT" ;;
esac
if [ "$1" = figures ]; then
    shift
    figures "$@"
    exit 0
fi
for name in "$@"; do
    case "$name" in
        list | check | outputs | accuracy | agreement | frontier | memory | constants | truths | factors | paper | readers) "$name" ;;
        *) fail "there is no $name: docs/make.sh list says what there is" ;;
    esac
done
