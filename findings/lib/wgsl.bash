# Asks two compilers of WGSL about a shader: naga, of wgpu and Firefox, and Tint, of Dawn and Chromium. Read
# after common.bash; wgsl_compilers comes first.
# shellcheck shell=bash disable=SC2154

wgsl_compilers() {
    cargo_build 'naga = { version = "=30.0.1", features = ["wgsl-in"] }' <<'RUST'
use naga::front::wgsl;
use naga::valid::{Capabilities, ValidationFlags, Validator};

fn main() {
    let source = std::io::read_to_string(std::io::stdin()).unwrap();
    let told = match wgsl::parse_str(&source) {
        Err(error) => Err(error.emit_to_string(&source)),
        Ok(module) => Validator::new(ValidationFlags::all(), Capabilities::all())
            .validate(&module)
            .map_err(|error| error.emit_to_string(&source)),
    };
    match told {
        Ok(_) => println!("takes"),
        Err(text) => {
            println!("refuses");
            eprintln!("{text}");
        }
    }
}
RUST
    npm_install webgpu@0.6.2
    # Its back end without a device compiles all the same.
    cat >"$work/node/tint.mjs" <<'JS'
import { readFileSync } from "node:fs";
import { create, globals } from "webgpu";

Object.assign(globalThis, globals);
const adapter = await create(["backend=null"]).requestAdapter();
const device = await adapter.requestDevice();
device.pushErrorScope("validation");
device.createShaderModule({ code: readFileSync(0, "utf8") });
const error = await device.popErrorScope();
console.log(error === null ? "takes" : "refuses");
if (error !== null) console.error(error.message);
process.exit(0);
JS
}
# WHAT NAGA TINT, the shader on stdin: what each is expected to do, `takes` or `refuses`.
judge() {
    local what=$1 naga tint
    cat >"$work/shader.wgsl"
    naga=$("$work/crate/target/debug/finding" <"$work/shader.wgsl" 2>"$work/naga.txt")
    # Warnings come before the answer.
    tint=$(node "$work/node/tint.mjs" <"$work/shader.wgsl" 2>"$work/tint.txt" | tail -n 1)
    grep -hE 'error:|  = [^n]' "$work/naga.txt" | sed 's/^ */naga says: /' || true
    grep -hE 'error:' "$work/tint.txt" | sed 's/^.*error:/Tint says: error:/' || true
    expect "naga, $what" "$naga" "$2"
    expect "Tint, $what" "$tint" "$3"
}
