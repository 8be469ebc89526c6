#[test]
fn pictures() {
    use super::*;
    use crate::twin::render::sample;
    let tunnel = sample::tunnel();
    let mut r = CpuRenderer::new(sample::scene());
    let mut draw = |name: &str, job: &Job| {
        let t = std::time::Instant::now();
        r.submit(job).unwrap();
        let images = r.collect().unwrap();
        println!("{name} {:?}", t.elapsed());
        for (k, i) in images.iter().enumerate() { i.save(format!("/tmp/cpu_{name}_{k}.png")).unwrap(); }
    };
    let job = sample::stereo_job(&tunnel, 100.0, 27.8);
    draw("stereo", &job);
    draw("stereo", &job);
    let mut bright = job.clone();
    bright.views.truncate(1);
    bright.views[0].sensor.grey_per_cd_s = 200000.0;
    draw("bright", &bright);
    let job = sample::wayside_job(&tunnel, 100.0);
    draw("wayside", &job);
    draw("wayside", &job);
    let job = sample::wayside_job(&tunnel, 400.0);
    draw("waycurve", &job);
    draw("waycurve", &job);
}
