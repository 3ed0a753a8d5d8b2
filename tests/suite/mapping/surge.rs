//! Surges: flux that travels down a sheet with its strands.

use taki::mapping::Surges;

use super::sheet::plumb;

#[test]
fn water_lacks_at_most_the_strength_and_surges_as_often_as_asked() {
    for count in [1u32, 3, 10] {
        let surges = Surges::new(0.6, count, 0.3, 5);
        for u in [0.0, 0.4, 1.0] {
            let lack: Vec<f32> = (0..1000).map(|i| surges.lack(u, f64::from(i) / 1000.0)).collect();
            assert!(lack.iter().all(|lack| (0.0..=0.6).contains(lack)));
            let step = |i: usize| lack[(i + 1) % 1000] - lack[i];
            assert!((0..1000).all(|i| step(i).abs() < 0.006 * count as f32), "a step between surges");
            let is_peak = |&i: &usize| step(i) > 0.0 && step((i + 1) % 1000) <= 0.0;
            assert_eq!((0..1000).filter(is_peak).count(), count as usize, "lulls at {u}");
        }
    }
    assert_eq!(Surges::new(0.0, 3, 0.3, 5).lack(0.5, 0.5), 0.0);
    let of = |seed| Surges::new(0.6, 3, 0.0, seed).lack(0.5, 0.1);
    assert_ne!(of(1), of(2));
}

#[test]
fn surges_travel_with_the_volume_and_return_with_it() {
    let [start, moved, returned] = [0.0, 0.2, 3.0].map(|flow| Surges::new(0.8, 4, flow, 1));
    for i in 0..100 {
        let (u, v) = (f64::from(i) / 99.0, f64::from(i * 7) / 50.0);
        let (then, now) = (start.lack(u as f32, v), moved.lack(u as f32, v + 0.2));
        assert!((then - now).abs() < 1e-5, "{then} and {now}");
        assert_eq!(start.lack(u as f32, v), returned.lack(u as f32, v));
    }
}

#[test]
fn sheets_surge_from_lip_to_foot_and_loops_close() {
    let with = |more: &str| plumb(&format!("segments = 40\nbreakup = 0.4\n{more}"));
    let (even, surging) = (with(""), with("surge = 0.5\nsurges = 4"));
    let (mut least, mut most) = (1.0f32, 0.0f32);
    for (a, b) in even.quads.iter().zip(&surging.quads) {
        for (even, surging) in a.erosion.iter().zip(b.erosion) {
            let left = (1.0 - surging) / (1.0 - even);
            (least, most) = (least.min(left), most.max(left));
        }
        assert_eq!((a.corners, a.offset), (b.corners, b.offset));
    }
    assert!(least > 0.499 && least < 0.7 && most > 0.8 && most <= 1.0, "{least} to {most} of the water");
    let at = |flow: &str| with(&format!("surge = 0.5\n[volume]\nflow = {flow}")).quads.clone();
    assert_eq!(at("0.0"), at("2.0"));
    assert_ne!(at("0.0"), at("0.1"));
}
