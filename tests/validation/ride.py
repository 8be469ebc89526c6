"""The table that src/twin/physics/validation/ride.rs holds the simulated car against.

    pip install numpy && python3 tests/validation/ride.py

The car of the Manchester benchmarks (Iwnicki, Vehicle System Dynamics 30 (1998) 295-313), as a textbook has
it: bounce and pitch of car and bogies, six coordinates, wheels that follow rigid rails. The track is the
German spectrum (low and high disturbance), the answer the exact integral over 0.3 to 30 Hz. The program's
linear model is another one: 42 coordinates from the vehicle file, rails that give, waves of 1 to 80 m.
"""
import numpy as np

CAR_KG, CAR_KG_M2 = 32_000.0, 1_970_000.0
BOGIE_KG, BOGIE_KG_M2 = 2_615.0, 1_476.0
# Of a bogie's secondary springs together, and of an axle's primary springs together.
SECONDARY = 2 * 430e3, 2 * 20e3  # N/m, N s/m
PRIMARY = 2 * 1220e3, 2 * 4e3
CAR_M, BOGIE_M = 19.0 / 2, 2.56 / 2  # half distances of bogies and of axles
LOW, HIGH = 4.032e-7, 1.08e-6  # m^2 rad/m


def element(matrix, row, value):
    matrix += value * np.outer(row, row)


def car():
    """Mass, damping, stiffness of (car bounce, pitch; bogie 1; bogie 2), and what 1 m of an axle pushes."""
    mass = np.diag([CAR_KG, CAR_KG_M2] + 2 * [BOGIE_KG, BOGIE_KG_M2])
    damping, stiffness = np.zeros((6, 6)), np.zeros((6, 6))
    axles = []
    for bogie, end in ((2, 1.0), (4, -1.0)):
        row = np.zeros(6)
        row[[0, 1, bogie]] = 1.0, end * CAR_M, -1.0  # pitch: nose up
        element(stiffness, row, SECONDARY[0])
        element(damping, row, SECONDARY[1])
        for axle in (1.0, -1.0):
            row = np.zeros(6)
            row[[bogie, bogie + 1]] = 1.0, axle * BOGIE_M
            element(stiffness, row, PRIMARY[0])
            element(damping, row, PRIMARY[1])
            axles.append((end * CAR_M + axle * BOGIE_M, row))
    return mass, damping, stiffness, axles


def density(roughness, wave):
    """One-sided, m^2 per rad/m."""
    corner, long = 0.8246**2, 0.0206**2
    return roughness * corner / ((wave**2 + long) * (wave**2 + corner))


def ride(roughness, kmh, step_hz=1e-3):
    mass, damping, stiffness, axles = car()
    speed = kmh / 3.6
    omega = 2 * np.pi * np.arange(0.3, 30.0, step_hz)
    dynamic = (stiffness - omega[:, None, None] ** 2 * mass + 1j * omega[:, None, None] * damping)
    force = sum(
        np.exp(1j * omega * at / speed)[:, None] * (PRIMARY[0] + 1j * omega * PRIMARY[1])[:, None] * row
        for at, row in axles
    )
    q = np.linalg.solve(dynamic, force[:, :, None])[:, :, 0]
    bounce, pitch = q[:, 0], q[:, 1]
    power = density(roughness, omega / speed) / speed * 2 * np.pi * step_hz

    def rms(response):
        return float(np.sqrt(np.sum(np.abs(response) ** 2 * power)))

    over_bogie = bounce + CAR_M * pitch
    return [rms(omega**2 * bounce), rms(omega**2 * over_bogie), 1e3 * rms(bounce), 1e3 * rms(pitch)]


print("centre m/s^2, over bogie m/s^2, bounce mm, pitch mrad")
for name, roughness, speeds in (("low", LOW, (20, 40, 60, 80)), ("high", HIGH, (60, 80))):
    for kmh in speeds:
        print(f"German {name}, {kmh} km/h: [" + ", ".join(f"{x:.4f}" for x in ride(roughness, kmh)) + "]")
