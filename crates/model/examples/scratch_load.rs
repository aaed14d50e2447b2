//! scratch
use palpate_model::*;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    for geometry in [Geometry::Collision, Geometry::Visual] {
        let options = LoadOptions { geometry, max_edge: args.get(2).map_or(0.02, |s| s.parse().unwrap()) };
        let t = std::time::Instant::now();
        match Robot::from_urdf_file(&args[1], &[], &[], &options) {
            Ok((robot, report)) => {
                println!("{geometry:?} {:?} joints {:?}", t.elapsed(), robot.joints.iter().map(|j| (&j.name, j.limits.map(|l| l.upper))).collect::<Vec<_>>());
                for (l, m) in report.links.iter().zip(&robot.links) {
                    println!("{} path {:?} el {} read {} -> tri {} vert {} {:?} open {} incons {} split {} vol {:.6} warn {:?}", l.name, m.path, l.elements, l.triangles_read, l.triangles, l.vertices, l.cleaning, l.open_edges, l.inconsistent_edges, l.split_edges, m.mesh.as_ref().map_or(0.0, |m| m.signed_volume()), l.warnings);
                }
            }
            Err(e) => println!("{e}"),
        }
    }
}
