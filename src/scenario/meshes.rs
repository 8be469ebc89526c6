//! Reads the meshes that obstacles name, so that the physics needs no files.

use super::file::ScenarioFile;
use crate::settings::{Problem, ReadLimit, read_bytes};
use crate::twin::geometry::Hull;
use crate::twin::physics::ObstacleShape;
use nalgebra::Point3;
use std::path::Path;
use std::sync::Arc;

/// More triangles than any obstacle's hull is worth.
const MAX_TRIANGLES: usize = 200_000;

/// Reads all meshes; relative paths count from `folder`.
pub(super) fn read_meshes(file: &mut ScenarioFile, folder: &Path, problems: &mut Vec<Problem>) {
    let obstacles = file.obstacles.iter_mut().enumerate();
    let obstacles = obstacles.map(|(k, o)| (format!("obstacles[{k}].body.file"), &mut o.body));
    let loads = file
        .workers
        .iter_mut()
        .enumerate()
        .filter_map(|(k, worker)| {
            let load = worker.carries.as_mut()?;
            Some((format!("workers[{k}].carries.body.file"), &mut load.body))
        });
    for (key, body) in obstacles.chain(loads) {
        let ObstacleShape::Mesh {
            file: name, hull, ..
        } = body
        else {
            continue;
        };
        let path = folder.join(name);
        match read_hull(&path) {
            Ok(read) => *hull = Some(Arc::new(read)),
            Err((what, remedy)) => {
                let what = format!("{}: {what}", path.display());
                problems.push(Problem::new(key, what, remedy));
            }
        }
    }
}

/// The convex hull of all meshes in a Wavefront OBJ file, or what is wrong and a remedy.
fn read_hull(path: &Path) -> Result<Hull, (String, String)> {
    let failed = |what: String, remedy: &str| (what, remedy.to_owned());
    let text = read_bytes(path, ReadLimit::OBJ).map_err(|error| {
        let remedy = "give the path of an OBJ file, counted from the scenario's folder";
        failed(format!("cannot read the mesh: {error}"), remedy)
    })?;
    // Materials are files of their own, and of no use here.
    let no_materials = |_: &Path| Ok(Default::default());
    let options = tobj::LoadOptions {
        triangulate: true,
        ..Default::default()
    };
    let (models, _) = tobj::load_obj_buf(&mut text.as_slice(), &options, no_materials)
        .map_err(|error| failed(error.to_string(), "export it as Wavefront OBJ (text) again"))?;
    let meshes = || models.iter().map(|model| &model.mesh);
    let triangles: usize = meshes().map(|mesh| mesh.indices.len() / 3).sum();
    let points: usize = meshes().map(|mesh| mesh.positions.len() / 3).sum();
    if triangles.max(points) > MAX_TRIANGLES {
        let what =
            format!("it has {triangles} triangles of {points} points, more than {MAX_TRIANGLES}");
        return Err(failed(what, "simplify it: only its convex hull is used"));
    }
    let points: Vec<Point3<f64>> = meshes()
        .flat_map(|mesh| mesh.positions.chunks_exact(3))
        .map(|p| Point3::new(p[0], p[1], p[2]))
        .collect();
    Hull::around(&points).ok_or_else(|| {
        let what = format!("its {} points enclose no volume", points.len());
        failed(what, "give a mesh of a solid body, with faces")
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]
    use super::*;
    use crate::scenario::{Scenario, ScenarioError};

    const CUBE: &str = "o cube\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 2\nv 1 0 2\nv 1 1 2\n\
        v 0 1 2\nmtllib none.mtl\nf 1 2 3 4\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

    fn scenario(folder: &Path, mesh: &str) -> Result<Scenario, ScenarioError> {
        std::fs::create_dir_all(folder).unwrap();
        let tunnel = Path::new(env!("CARGO_MANIFEST_DIR")).join("tunnels/test_bench.toml");
        let text = format!(
            "name = \"mesh\"\ntunnel = '{}'\n[train]\nstart_chainage_m = 150.0\nstop_at_m = 200.0\n\
             [[obstacles]]\nchainage_m = 190.0\nbody = {{ shape = \"mesh\", file = \"{mesh}\", \
             scale = 0.5 }}\n",
            tunnel.display()
        );
        Scenario::from_text(&folder.join("scenario.toml"), &text, &[])
    }

    /// Fails where a mesh is not found beside the scenario, its scale is lost, or a bad file is
    /// taken, or named without its key, its path and a remedy.
    #[test]
    fn meshes_are_read_from_beside_the_scenario() {
        let folder = std::env::temp_dir().join(format!("metrotwin-mesh-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
        write("cube.obj", CUBE);
        write("flat.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n");
        write("text.obj", "v 0 0 zero\nf 1 2 3\n");
        write("huge.obj", &CUBE.replace("v 1 ", "v 1000 "));
        let good = scenario(&folder, "cube.obj").unwrap();
        let body = &good.physics.obstacles[0].body;
        let body = body
            .body(crate::twin::random::Stream::new(1, 0, ""))
            .unwrap();
        assert!((body.half_extents_m() - nalgebra::Vector3::new(0.25, 0.25, 0.5)).norm() < 1e-9);
        for (name, what) in [
            ("none.obj", "cannot read"),
            ("flat.obj", "no volume"),
            ("text.obj", "OBJ"),
            ("huge.obj", "out of range"),
        ] {
            let error = scenario(&folder, name).unwrap_err().to_string();
            assert!(error.contains("obstacles[0].body"), "{error}");
            assert!(error.contains(what), "{name}: {error}");
            assert!(error.contains(name) || name == "huge.obj", "{error}");
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
