//! Files that a model names: those in its folder, and no others.

use serde_json::json;
use taki::Unwatched;
use taki::model::{ImageSource, Limits, Model};

use super::{Doc, Folder};

/// Folder with a model in `in/`, whose buffer or image is named by `uri`, and a file beside that folder.
fn folder(uri: &str, image: bool) -> Folder {
    let mut doc = Doc::square();
    let bin = doc.bin.clone();
    if image {
        doc.json["images"] = json!([{"uri": uri}]);
        doc.json["buffers"][0]["uri"] = json!("a.bin");
    } else {
        doc.json["buffers"][0]["uri"] = json!(uri);
    }
    Folder::new(&[
        ("in/m.gltf", doc.json.to_string().as_bytes()),
        ("in/a.bin", &bin),
        ("in/50%25.bin", &bin),
        ("in/sub/b.bin", &bin),
        ("out.bin", &bin),
    ])
}

#[test]
fn files_in_the_folder_are_found() {
    for uri in [
        "a.bin",
        "./a.bin",
        "sub/b.bin",
        "sub/../a.bin",
        "sub%2Fb.bin",
        "../in/a.bin",
        "%61.bin",
        "50%2525.bin",
        "50%25.bin",
    ] {
        assert!(folder(uri, false).read("in/m.gltf").is_ok(), "{uri}");
    }
}

#[test]
fn ways_out_of_the_folder_are_refused() {
    for (uri, words) in [
        ("../out.bin", "leads out of the folder"),
        ("%2e%2e/out.bin", "leads out of the folder"),
        ("sub/../../out.bin", "leads out of the folder"),
        ("..%2Fout.bin", "leads out of the folder"),
        ("/etc/passwd", "absolute path"),
        ("%2Fetc%2Fpasswd", "absolute path"),
        ("\\\\server\\a.bin", "absolute path"),
        ("file:///etc/passwd", "not a relative path"),
        ("FILE:a.bin", "not a relative path"),
        ("http://localhost/a.bin", "not a relative path"),
        ("C:\\a.bin", "not a relative path"),
        ("a.bin%00.png", "is no path"),
        ("", "is no path"),
        ("none.bin", "cannot find"),
        ("sub", "not a regular file"),
    ] {
        let error = folder(uri, false).error("in/m.gltf");
        let text = error.to_string();
        assert!(error.exit_code() == 65 && text.contains("buffers[0].uri"), "{uri}: {text}");
        assert!(text.contains(words), "{uri}: {text}");
        // An image that cannot be had is missed only where it is needed.
        let model = folder(uri, true).model("in/m.gltf");
        assert!(matches!(model.images[0], ImageSource::Refused { .. }), "{uri}");
        let text = model.images[0].decode(1 << 20).expect_err("no image").to_string();
        assert!(text.contains("images[0]") && text.contains(words), "{uri}: {text}");
    }
}

#[test]
fn an_allowed_folder_is_open() {
    let folder = folder("../out.bin", false);
    let limits = Limits { allow_paths: vec![folder.path("")], ..Limits::default() };
    assert!(Model::read(&folder.path("in/m.gltf"), &limits, &Unwatched).is_ok());
}

#[cfg(unix)]
#[test]
fn links_out_of_the_folder_are_not_followed() {
    let folder = folder("link.bin", false);
    std::os::unix::fs::symlink(folder.path("out.bin"), folder.path("in/link.bin")).expect("a link");
    assert!(folder.error("in/m.gltf").to_string().contains("leads out of the folder"));
}

#[test]
fn a_buffer_that_is_too_short_or_broken_is_refused() {
    let error = |uri: &str| folder(uri, false).error("in/m.gltf").to_string();
    assert!(error("data:;base64,AAAA").contains("buffers[0]: it should have"));
    assert!(error("data:;base64,A*AA").contains("buffers[0].uri: its base64 is broken"));
    assert!(error("data:nothing").contains("buffers[0]: it should have"));
}

#[test]
fn libraries_and_textures_of_obj_are_confined() {
    for name in ["../out.mtl", "/etc/passwd", "file:a.mtl", "..\\out.mtl"] {
        let obj = format!("mtllib {name}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl A\nf 1 2 3\n");
        let folder = Folder::new(&[("in/a.obj", obj.as_bytes()), ("out.mtl", b"newmtl A\nKd 0 0 0\n")]);
        let model = folder.model("in/a.obj");
        assert_eq!(model.materials[0].base_color, [1.0; 4], "{name}");
        assert!(model.notes[0].contains("mtllib"), "{:?}", model.notes);
    }
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl A\nf 1 2 3\n";
    for name in ["../out.png", "/etc/passwd", "C:\\pictures\\a.png"] {
        let library = format!("newmtl A\nmap_Kd {name}\n");
        let files = [("in/a.obj", obj.as_bytes()), ("in/a.mtl", library.as_bytes()), ("out.png", b"x")];
        let model = Folder::new(&files).model("in/a.obj");
        let text = model.images[0].decode(1 << 20).expect_err("no image").to_string();
        assert!(text.contains("a.mtl: line 2"), "{text}");
    }
}
