//! Keys of long hair and of strands from a file: where they stand, what is refused, what has no effect.

use glam::{DVec3, Vec3};
use taki::job::VolumeMemo;
use taki::model::Strands;
use taki::scene::{Limits, Scene, settings_without_effect};
use taki::util::monitor::Unwatched;
use taki::volume::Matter;

use super::meshes::{Folder, PLACE};

/// Writes two strands of 4 and 2 m, on x = 1 and 3, z up, and the scene with a box around them.
fn scene(own: &str, width: f32) -> (Folder, Result<Scene, String>) {
    let folder = Folder::new();
    let mut strands = Strands::default();
    for (x, height) in [(1.0, 4.0), (3.0, 2.0)] {
        strands.push((0..=8).map(|i| (Vec3::new(x, 0.5, height * i as f32 / 8.0), width)));
    }
    let mut bytes = Vec::new();
    strands.write(&mut bytes).expect("written");
    std::fs::write(folder.path("two.hair"), bytes).expect("written");
    let text = format!(
        "{PLACE}[volumes.s]\nbuilder = \"strands\"\nsource = \"two.hair\"\nup = \"z\"\n{own}\n[boxes.b]\n\
         volume = \"s\"\n"
    );
    folder.write("s.toml", &text);
    let scene = Scene::load(&folder.path("s.toml"), &[], &Limits::default()).map_err(|e| e.to_string());
    (folder, scene)
}

#[test]
fn a_box_stands_where_the_strands_of_a_file_stand() {
    for (own, unit) in [("longest = 82", 1.0), ("longest = 82\nfile_unit = 0.01", 0.01)] {
        let (_folder, scene) = scene(own, 0.0625);
        let scene = scene.expect("a scene");
        let Some(Matter::Strands(spec)) = &scene.recipes[0].matter else { panic!("no strands") };
        // 4 m and the width of a strand lie in 80 cells; a cell is left on each side.
        assert_eq!(spec.edge, 4.0625 / 80.0);
        assert_eq!(spec.size, [(2.0625 / spec.edge).ceil() as u32 + 2, 4, 82]);
        let volumes = VolumeMemo::default().volumes(&scene, 1 << 30, &Unwatched).expect("volumes").0;
        let volume = &volumes[0];
        // Each cell that is filled lies around one of the strands, whose z is the scene's y.
        let [nx, ny, nz] = volume.size;
        let mut filled = 0.0;
        for (x, y, z) in (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (x, y, z)))) {
            let cell = volume.cell(x, y, z);
            if cell.rho_code() == 0 {
                continue;
            }
            let size = DVec3::new(nx.into(), ny.into(), nz.into());
            let at = (DVec3::new(x.into(), y.into(), z.into()) + 0.5) / size;
            let place = scene.boxes[0].world_from_texture.transform_point3(at) / unit;
            let edge = f64::from(spec.edge);
            let near = |x: f64, height: f64| {
                (place.x - x).abs() < 1.5 * edge && (-edge..height + edge).contains(&place.y)
            };
            assert!(near(1.0, 4.0) || near(3.0, 2.0), "{place}");
            assert!((place.z + 0.5).abs() < 1.5 * edge, "{place}");
            assert!(cell.v().z > 0.99, "{}: from root to tip", cell.v());
            filled += f64::from(cell.rho() * spec.edge * spec.edge);
        }
        // A strand wider than a cell fills its round: between 0.7 and 1 of width² over the length of both.
        let share = filled * f64::from(spec.edge) / (6.0 * 0.0625 * 0.0625);
        assert!((0.7..1.05).contains(&share), "{share}");
    }
}

#[test]
fn a_file_of_usd_says_its_unit_and_axes_unless_the_scene_does() {
    let folder = Folder::new();
    let usd = |height: f32, head: &str| {
        format!(
            "#usda 1.0\n({head})\ndef BasisCurves \"a\" {{ uniform token type = \"linear\" int[] \
             curveVertexCounts = [2] point3f[] points.timeSamples = {{ 7: [(0,0,0), (0,0,{height})], 9: \
             [(0,0,0), (0,0,{})] }} float[] widths = [1] (interpolation = \"constant\") }}\ndef \
             PointInstancer \"p\" {{}}\n",
            2.0 * height
        )
    };
    for number in [7, 9] {
        folder.write(&format!("a.{number}.usda"), usd(100.0, "metersPerUnit = 0.01 upAxis = \"Z\""));
    }
    let load = |source: &str, own: &str| {
        let text = format!(
            "{PLACE}[volumes.s]\nbuilder = \"strands\"\nsource = \"{source}\"\n{own}\n[boxes.b]\nvolume = \
             \"s\"\n"
        );
        folder.write("s.toml", &text);
        Scene::load(&folder.path("s.toml"), &[], &Limits::default()).expect("a scene")
    };
    // Where the tip of the strand lies, metres.
    let tip = |scene: &Scene| {
        let Some(Matter::Strands(spec)) = &scene.recipes[0].matter else { panic!("no strands") };
        spec.scene_from_file * spec.strands.points[1].as_dvec3() * spec.unit
    };
    let near = |source: &str, own: &str, place: DVec3| {
        let tip = tip(&load(source, own));
        assert!(tip.distance(place) < 1e-6, "{own}: {tip}");
    };
    near("a.7.usda", "", DVec3::Y);
    near("a.7.usda", "up = \"y\"", DVec3::Z);
    near("a.7.usda", "file_unit = 1.0", DVec3::Y * 100.0);
    // A file of a sequence is read at its number.
    near("a.9.usda", "", DVec3::Y);
    near("a.#.usda", "frame = 9", DVec3::Y * 2.0);
    near("a.#.usda", "frame = 7", DVec3::Y);
    let scene = load("a.7.usda", "longest = 20");
    let volumes = VolumeMemo::default().volumes(&scene, 1 << 30, &Unwatched).expect("volumes").0;
    let warned = scene.warnings(&*volumes).into_iter().any(|own| own.contains("/p is a point instancer"));
    assert!(warned);
}

#[test]
fn strands_without_thickness_take_that_of_the_scene() {
    let (_folder, told) = scene("", 0.0);
    super::refused(told, &["no thickness", "volumes.s.strand_diameter"]);
    let (_folder, given) = scene("strand_diameter = 0.02", 0.0);
    let given = given.expect("a scene");
    let Some(Matter::Strands(spec)) = &given.recipes[0].matter else { panic!("no strands") };
    assert_eq!(spec.width, Some(0.02));
    for (own, words) in
        [("storage = \"sparse\"", &["volumes.s.storage", "auto"][..]), ("memory = 1", &["memory"])]
    {
        super::refused(scene(own, 0.1).1, words);
    }
}

#[test]
fn a_file_of_hair_leads_to_its_builder() {
    for sets in [
        &["volume.builder=hair", "volume.source=wig.hair"][..],
        &["volume.source=wig.HAIR"],
        &["volume.builder=flow", "volume.source=wig.hair"],
        &["volume.file=wig.hair"],
        &["volume.source=wig.usdc"],
        &["volume.file=wig.usd"],
    ] {
        let told = Scene::preset("fig5").expect("a preset").with(sets).map_err(|e| e.to_string());
        super::refused(told, &["volume.builder=strands", "volume.source"]);
    }
}

#[test]
fn strands_too_fine_for_the_memory_name_the_key_that_makes_them_so() {
    let (folder, _scene) = scene("longest = 400", 0.1);
    let limits = Limits { memory: 8 << 20, ..Limits::default() };
    let told = Scene::load(&folder.path("s.toml"), &[], &limits).map_err(|e| e.to_string());
    super::refused(told, &["volumes.s.longest", "--memory"]);
}

#[test]
fn fibres_of_hair_do_without_k() {
    let hair = ["volume.builder=hair", "light.reflection=hair"];
    let hair = Scene::preset("fig5").expect("a preset").with(&hair).expect("valid");
    for set in ["volume.k_d=0.5", "volume.k_s=0.1", "tress.strand_shade=0.5"] {
        let set = set.to_owned();
        let values = hair.with(&[&set]).expect("valid");
        assert!(!settings_without_effect(values.values().expect("values"), &[set], &[]).is_empty());
    }
    // The same goes for the keys of a volume with a name.
    let (_folder, strands) = scene("", 0.1);
    let strands = strands.expect("a scene");
    let said = |sets: &[&str]| {
        let values = strands.with(sets).expect("valid");
        let last = [sets[sets.len() - 1].to_owned()];
        !settings_without_effect(values.values().expect("values"), &last, &[]).is_empty()
    };
    assert!(!said(&["volumes.s.k_d=0.5"]));
    assert!(said(&["light.reflection=hair", "volumes.s.k_d=0.5"]));
}

#[test]
fn keys_of_hair_and_of_files_have_their_effect_with_their_builder_alone() {
    let hair = Scene::preset("fig5").expect("a preset").with(&["volume.builder=hair"]).expect("valid");
    let said = |scene: &Scene, set: &str| {
        let set = set.to_owned();
        !settings_without_effect(scene.with(&[&set]).expect("valid").values().expect("values"), &[set], &[])
            .is_empty()
    };
    for set in ["tress.waves=2", "fur.taper=0.2", "curves.across=20", "import.longest=30", "volume.up=z"] {
        assert!(said(&hair, set), "{set}");
    }
    for set in ["tress.wave=0.1", "tress.gathering=0.2", "curves.h=0.8", "volume.seed=3", "volume.nx=20"] {
        assert!(!said(&hair, set), "{set}");
    }
    let loose = hair.with(&["tress.locks=0"]).expect("valid");
    assert!(said(&loose, "tress.gathering=0.2") && said(&loose, "tress.wave=0.2"));
    let (_folder, strands) = scene("", 0.1);
    let strands = strands.expect("a scene");
    for set in ["volumes.s.nx=20", "volumes.s.seed=3", "volumes.s.amplitude=0.3", "volumes.s.grid=smoke"] {
        assert!(said(&strands, set), "{set}");
    }
    // The file is one that the picture depends on.
    assert_eq!(strands.references()[0].0, "volumes.s.source");
    assert!(!said(&strands, "volumes.s.longest=30") && !said(&strands, "volumes.s.up=y"));
}
