"""Runs the example of a data set's README.md, and holds its rays against the lamps of the set.

    pip install opencv-python-headless pyarrow pandas pycocotools
    python3 tests/dataset.py out/set
"""
import os
import sys
from pathlib import Path

os.chdir(sys.argv[1])
example = Path("README.md").read_text().split("```python\n")[1].split("```")[0]
exec(example)

# A lamp's centre is seen in row v of the image: in the axes of that row's camera it lies on the ray
# of its pixel.
seen = lamps[["u_px", "v_px"]].to_numpy().reshape(-1, 1, 2)
of_lamps = cv2.undistortPoints(seen, K, distortion, criteria=(3, 200, 1e-12)).reshape(-1, 2)
by_default = cv2.undistortPoints(seen, K, distortion).reshape(-1, 2)
grid = rays.reshape(*depth.shape, 2)
worst_px = grid_px = default_px = 0.0
for lamp, ray, rough in zip(lamps.itertuples(), of_lamps, by_default):
    if not 0 <= lamp.v_px < f.height_px - 1 or not 0 <= lamp.u_px < f.width_px - 1:
        continue
    k, u = int(lamp.v_px), int(lamp.u_px)
    share = lamp.v_px - k

    def between(column):
        return (1 - share) * rows[column][k] + share * rows[column][k + 1]

    x, y, z, w = (between(c) for c in ["qx", "qy", "qz", "qw"])
    norm = np.sqrt(x * x + y * y + z * z + w * w)
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    turn = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])
    way = np.array([getattr(lamp, c) - between(c) for c in ["x_m", "y_m", "z_m"]])
    point = turn.T @ way
    assert abs(point[2] - lamp.depth_m) < 1e-4, "depth"
    true = point[:2] / point[2]
    worst_px = max(worst_px, f.fx_px * np.abs(ray - true).max())
    default_px = max(default_px, f.fx_px * np.abs(rough - true).max())
    # The grid of the example, between its pixels.
    a, b = lamp.u_px - u, share
    here = (1 - b) * ((1 - a) * grid[k, u] + a * grid[k, u + 1])
    here = here + b * ((1 - a) * grid[k + 1, u] + a * grid[k + 1, u + 1])
    grid_px = max(grid_px, f.fx_px * np.abs(here - true).max())
assert worst_px > 0.0, "no lamp is in the picture"
print(f"{len(lamps)} lamps: {worst_px:.1e} px, by the grid {grid_px:.1e} px; OpenCV's default {default_px:.1e} px")
assert worst_px < 1e-3 and grid_px < 1e-2, (worst_px, grid_px)
