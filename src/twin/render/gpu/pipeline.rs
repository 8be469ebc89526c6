//! The pipelines of the passes.

use super::layout::{MAX_HEADLIGHTS, Placement, Vertex};
use super::shaders::shader_source;
use crate::twin::render::sensor::BLOOMING_REACH;
use std::cell::OnceCell;
use std::mem::size_of;

/// Signal in electrons; half precision keeps 11 bits, finer than the shot noise anywhere.
pub const SIGNAL: wgpu::TextureFormat = wgpu::TextureFormat::R16Float;
/// Reversed depth.
pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Four pixels of the finished image a texel.
pub const RAW: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Uint;

/// Steady and blinking light of a tunnel that is kept.
pub const LIGHT: wgpu::TextureFormat = wgpu::TextureFormat::Rg16Float;
/// Whose blinking it is: a row of the table of shares.
pub const LAMP: wgpu::TextureFormat = wgpu::TextureFormat::R16Uint;

/// Tunnel and bodies.
pub struct Background {
    /// Where the blinking of lamps does not show, and where it does; each with paint that is sharp and
    /// with paint that is smeared.
    pub lit: [[wgpu::RenderPipeline; 2]; 2],
    /// The same with sharp paint, where the depth is that of the surface already.
    pub relit: [wgpu::RenderPipeline; 2],
    /// Steady and blinking light apart, without headlights.
    pub split: wgpu::RenderPipeline,
    /// What glossy surfaces mirror, times the blend constant and added.
    pub gloss: wgpu::RenderPipeline,
}

/// One pipeline a pass.
pub struct Pipelines {
    /// Tunnel and bodies under 0, 1, ... headlights, each made when first asked for.
    backgrounds: [OnceCell<Background>; MAX_HEADLIGHTS + 1],
    background: wgpu::ShaderModule,
    gloss: wgpu::ShaderModule,
    /// Nothing, in parts of the picture.
    pub clear: wgpu::RenderPipeline,
    /// Mixes a share of one picture into another.
    pub blend: wgpu::RenderPipeline,
    /// Blurs along rows, and along columns.
    pub focus: [wgpu::RenderPipeline; 2],
    /// Shadows of capsules, and of any bodies, over the background.
    pub shadows: [wgpu::RenderPipeline; 2],
    /// Lamps' discs, over the background by coverage.
    pub discs: wgpu::RenderPipeline,
    /// Lamps' glare, added up.
    pub glare: wgpu::RenderPipeline,
    /// The sensor without and with blooming, each made when first asked for.
    sensors: [OnceCell<wgpu::RenderPipeline>; 2],
    sensor: wgpu::ShaderModule,
}

struct Stage<'a> {
    shader: &'a wgpu::ShaderModule,
    entries: [&'a str; 2],
    buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    depth: Option<wgpu::DepthStencilState>,
    targets: &'a [Option<wgpu::ColorTargetState>],
    constants: &'a [(&'a str, f64)],
}

impl Pipelines {
    /// Compiles all shaders.
    pub fn new(device: &wgpu::Device) -> Self {
        let shader = |name: &str| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(name),
                source: wgpu::ShaderSource::Wgsl(shader_source(name).unwrap_or_default().into()),
            })
        };
        let (lamps, glare, blend) = (shader("lamps"), shader("glare"), shader("blend"));
        let (focus, shadows, clear) = (shader("focus"), shader("shadows"), shader("clear"));
        let flat = |shader: &_, entries: [&str; 2], target, constants: &[(&str, f64)]| {
            flat_pipeline(device, shader, entries, target, constants)
        };
        let flags = [0.0, 1.0];
        let over = Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING);
        Self {
            backgrounds: [const { OnceCell::new() }; MAX_HEADLIGHTS + 1],
            background: shader("background"),
            gloss: shader("gloss"),
            clear: clearing(device, &clear),
            blend: flat(&blend, ["whole", "share"], target(SIGNAL, Some(SHARE)), &[]),
            focus: flags.map(|down| {
                let target = target(SIGNAL, None);
                flat(&focus, ["whole", "focus"], target, &[("DOWN", down)])
            }),
            shadows: flags.map(|others| {
                let target = target(SIGNAL, Some(FADE));
                flat(
                    &shadows,
                    ["tile_corner", "shade"],
                    target,
                    &[("OTHERS", others)],
                )
            }),
            discs: flat(&lamps, ["disc_corner", "disc"], target(SIGNAL, over), &[]),
            glare: flat(&glare, ["glare_corner", "glare"], target(SIGNAL, over), &[]),
            sensors: [const { OnceCell::new() }; 2],
            sensor: shader("sensor"),
        }
    }

    /// The pipelines that draw tunnel and bodies under so many headlights.
    pub fn background(&self, device: &wgpu::Device, headlights: usize) -> &Background {
        let headlights = headlights.min(MAX_HEADLIGHTS);
        self.backgrounds[headlights].get_or_init(|| {
            let headlights = ("HEADLIGHTS", headlights as f64);
            let light = [Some(target(SIGNAL, None))];
            let lit = |banded, smeared, depth| {
                let constants = [headlights, ("BANDED", banded), ("SMEARED", smeared)];
                let entries = (&self.background, "lit");
                surface(device, entries, &constants, &light, depth)
            };
            let same = depths(false, wgpu::CompareFunction::Equal);
            let flags = [0.0, 1.0];
            let split = [target(LIGHT, None), target(LAMP, None)].map(Some);
            let added = [Some(target(SIGNAL, Some(ADD)))];
            Background {
                lit: flags.map(|banded| flags.map(|smeared| lit(banded, smeared, drawn_depth()))),
                relit: flags.map(|banded| lit(banded, 0.0, same.clone())),
                split: surface(
                    device,
                    (&self.background, "split"),
                    &[],
                    &split,
                    drawn_depth(),
                ),
                gloss: surface(
                    device,
                    (&self.gloss, "gloss"),
                    &[headlights],
                    &added,
                    added_depth(),
                ),
            }
        })
    }

    /// The pipeline that develops a picture, where charge over the full well spills or does not.
    pub fn sensor(&self, device: &wgpu::Device, blooming: bool) -> &wgpu::RenderPipeline {
        self.sensors[usize::from(blooming)].get_or_init(|| {
            let reach = if blooming { BLOOMING_REACH } else { 0 };
            let reach = [("BLOOMING_REACH", reach as f64)];
            let target = target(RAW, None);
            flat_pipeline(device, &self.sensor, ["whole", "develop"], target, &reach)
        })
    }
}

/// Draws rectangles, without buffers or depth.
fn flat_pipeline(
    device: &wgpu::Device,
    shader: &wgpu::ShaderModule,
    entries: [&str; 2],
    target: wgpu::ColorTargetState,
    constants: &[(&str, f64)],
) -> wgpu::RenderPipeline {
    let stage = Stage {
        shader,
        entries,
        buffers: &[],
        depth: None,
        targets: &[Some(target)],
        constants,
    };
    pipeline(device, stage)
}

/// Draws rectangles over whatever is there, depths too.
fn clearing(device: &wgpu::Device, shader: &wgpu::ShaderModule) -> wgpu::RenderPipeline {
    let stage = Stage {
        shader,
        entries: ["part_corner", "clear"],
        buffers: &[],
        depth: Some(depths(true, wgpu::CompareFunction::Always)),
        targets: &[Some(target(SIGNAL, None))],
        constants: &[],
    };
    pipeline(device, stage)
}

fn depths(written: bool, compare: wgpu::CompareFunction) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(written),
        depth_compare: Some(compare),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    }
}

/// Of surfaces that hide each other.
fn drawn_depth() -> wgpu::DepthStencilState {
    depths(true, wgpu::CompareFunction::Greater)
}

/// Of surfaces that are added to what was drawn: they must not be behind themselves by a rounding.
fn added_depth() -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        bias: wgpu::DepthBiasState {
            constant: 16,
            slope_scale: 0.01,
            clamp: 0.0,
        },
        ..depths(false, wgpu::CompareFunction::Greater)
    }
}

/// Draws surfaces as a shader's two entries for a kind of light do.
fn surface(
    device: &wgpu::Device,
    (shader, kind): (&wgpu::ShaderModule, &str),
    constants: &[(&str, f64)],
    targets: &[Option<wgpu::ColorTargetState>],
    depth: wgpu::DepthStencilState,
) -> wgpu::RenderPipeline {
    let entries = [format!("project_{kind}"), format!("shade_{kind}")];
    let layout = |stride, step_mode, attributes| {
        Some(wgpu::VertexBufferLayout {
            array_stride: stride as u64,
            step_mode,
            attributes,
        })
    };
    let stage = Stage {
        shader,
        entries: [&entries[0], &entries[1]],
        buffers: &[
            layout(size_of::<Vertex>(), wgpu::VertexStepMode::Vertex, &VERTEX),
            layout(
                size_of::<Placement>(),
                wgpu::VertexStepMode::Instance,
                &PLACEMENT,
            ),
        ],
        depth: Some(depth),
        targets,
        constants,
    };
    pipeline(device, stage)
}

/// The source's share is the blend constant, the rest is what was there.
const SHARE: wgpu::BlendState = sum_of(
    wgpu::BlendFactor::Constant,
    wgpu::BlendFactor::OneMinusConstant,
);
/// Adds the source times the blend constant.
const ADD: wgpu::BlendState = sum_of(wgpu::BlendFactor::Constant, wgpu::BlendFactor::One);
/// Keeps the share in the alpha of what is there, and adds the source.
const FADE: wgpu::BlendState = sum_of(wgpu::BlendFactor::One, wgpu::BlendFactor::SrcAlpha);

const fn sum_of(src_factor: wgpu::BlendFactor, dst_factor: wgpu::BlendFactor) -> wgpu::BlendState {
    let sum = wgpu::BlendComponent {
        src_factor,
        dst_factor,
        operation: wgpu::BlendOperation::Add,
    };
    wgpu::BlendState {
        color: sum,
        alpha: sum,
    }
}

/// The members of [`Vertex`] that shaders read, one after the other.
const VERTEX: [wgpu::VertexAttribute; 7] = wgpu::vertex_attr_array![
    0 => Float32x3, 1 => Float32x3, 2 => Float32x2, 3 => Float32x2, 4 => Float32, 6 => Float32,
    13 => Float32x3
];

/// Those of [`Placement`].
const PLACEMENT: [wgpu::VertexAttribute; 8] = wgpu::vertex_attr_array![
    7 => Float32x3, 8 => Float32, 9 => Float32x3, 10 => Float32, 11 => Uint32, 12 => Float32x2,
    14 => Float32x3, 15 => Float32
];

fn target(format: wgpu::TextureFormat, blend: Option<wgpu::BlendState>) -> wgpu::ColorTargetState {
    wgpu::ColorTargetState {
        format,
        blend,
        write_mask: wgpu::ColorWrites::ALL,
    }
}

fn pipeline(device: &wgpu::Device, stage: Stage<'_>) -> wgpu::RenderPipeline {
    let options = wgpu::PipelineCompilationOptions {
        constants: stage.constants,
        ..Default::default()
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(stage.entries[1]),
        layout: None,
        vertex: wgpu::VertexState {
            module: stage.shader,
            entry_point: Some(stage.entries[0]),
            compilation_options: options.clone(),
            buffers: stage.buffers,
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: stage.depth,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: stage.shader,
            entry_point: Some(stage.entries[1]),
            compilation_options: options,
            targets: stage.targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
