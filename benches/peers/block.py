"""The ten-step neo-Hookean block in CalculiX and FElupe, and in pliant: total processor time and the answer.

    python3 -m venv target/peers/venv && target/peers/venv/bin/pip install felupe pypardiso
    apt-get install calculix-ccx                       # or any `ccx` on the path
    target/peers/venv/bin/python benches/peers/block.py [--cells 7 8 5] [--rounds 3]

A block of 50 x 50 x 25 mm in structured tetrahedra (six a cell, Kuhn), clamped below, 15 N spread evenly over the top
nodes within 8.5 mm of the middle, in ten equal steps, Newton to 1e-8, dead loads. Energy mu/2 (J^(-2/3) I1 - 3) +
K/2 (J - 1)^2, E = 0.15 MPa, nu = 0.4. Every code runs on one thread; rounds alternate between the codes, and the
medians count. What is not installed is said and skipped. Processor time is the user's and the system's share of the
solve: for CalculiX the whole process (reading 2 000 lines and starting are a few ms), for FElupe the steps alone
without start, imports and mesh; for pliant what its bench prints.
"""

import argparse
import os
import pathlib
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile

for name in ["OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_THREAD_LIMIT"]:
    os.environ[name] = "1"

SIZE = (50.0, 50.0, 25.0)
KUHN = [(0, 1, 2, 6), (0, 5, 1, 6), (0, 4, 5, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6)]
YOUNG, POISSON, FORCE, STEPS, RADIUS = 0.15, 0.4, 15.0, 10, 8.5
SHEAR = YOUNG / (2 * (1 + POISSON))
BULK = YOUNG / (3 * (1 - 2 * POISSON))
# Five codes agree on these to 1e-8 mm: DOLFINx, CalculiX, FElupe, scikit-fem and a prototype.
EXPECTED = {(7, 8, 5): -3.2384626163, (11, 12, 10): -3.7689840}


def block(counts):
    nx, ny, nz = counts
    line = lambda size, n: [size * i / n for i in range(n + 1)]
    nodes = [(x, y, z) for z in line(SIZE[2], nz) for y in line(SIZE[1], ny) for x in line(SIZE[0], nx)]
    at = lambda i, j, k: i + (nx + 1) * (j + (ny + 1) * k)
    tets = []
    for k in range(nz):
        for j in range(ny):
            for i in range(nx):
                ring = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
                corners = [at(a, b, k) for a, b in ring] + [at(a, b, k + 1) for a, b in ring]
                tets += [[corners[c] for c in tet] for tet in KUHN]
    fixed = [n for n, x in enumerate(nodes) if x[2] == 0.0]
    middle = (SIZE[0] / 2, SIZE[1] / 2)
    near = lambda x: (x[0] - middle[0]) ** 2 + (x[1] - middle[1]) ** 2 <= RADIUS**2 + 1e-9
    patch = [n for n, x in enumerate(nodes) if x[2] == SIZE[2] and near(x)]
    return nodes, tets, fixed, patch


def calculix_deck(nodes, tets, fixed, patch):
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{n + 1}, {x:.15g}, {y:.15g}, {z:.15g}" for n, (x, y, z) in enumerate(nodes)]
    lines += ["*ELEMENT, TYPE=C3D4, ELSET=BLOCK"]
    lines += [f"{e + 1}, " + ", ".join(str(n + 1) for n in tet) for e, tet in enumerate(tets)]
    lines += ["*NSET, NSET=FIXED"] + [f"{n + 1}," for n in fixed]
    lines += ["*NSET, NSET=PATCH"] + [f"{n + 1}," for n in patch]
    lines += ["*MATERIAL, NAME=RUBBER", "*HYPERELASTIC, NEO HOOKE", f"{SHEAR / 2:.16g}, {2 / BULK:.16g}"]
    lines += ["*SOLID SECTION, ELSET=BLOCK, MATERIAL=RUBBER", "*BOUNDARY", "FIXED, 1, 3"]
    lines += ["*STEP, NLGEOM, INC=100", "*STATIC, DIRECT, SOLVER=SPOOLES", f"{1 / STEPS}, 1."]
    lines += ["*CONTROLS, PARAMETERS=FIELD", "1.e-8, 1.e-8"]
    lines += ["*CLOAD"] + [f"{n + 1}, 3, {-FORCE / len(patch):.16g}" for n in patch]
    lines += ["*NODE PRINT, NSET=PATCH, FREQUENCY=10", "U", "*END STEP"]
    return "\n".join(lines) + "\n"


def calculix(counts):
    program = shutil.which("ccx")
    if program is None:
        return None
    nodes, tets, fixed, patch = block(counts)
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder)
        (path / "block.inp").write_text(calculix_deck(nodes, tets, fixed, patch))
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run([program, "block"], cwd=folder, capture_output=True, text=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if done.returncode != 0:
            sys.exit(f"CalculiX failed:\n{done.stdout[-2000:]}")
        rows = (path / "block.dat").read_text().split("displacements")[-1].splitlines()
    down = [float(row.split()[3]) for row in rows if len(row.split()) == 4 and row.split()[0].isdigit()]
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return 1e3 * cpu, statistics.fmean(down)


FELUPE = """
import json, sys, time
import felupe as fem, numpy as np
from pypardiso import spsolve
sys.path.insert(0, sys.argv[1])
import block as b
nodes, tets, fixed, patch = b.block(json.loads(sys.argv[2]))
mesh = fem.Mesh(np.array(nodes), np.array(tets), "tetra")
field = fem.FieldContainer([fem.Field(fem.RegionTetra(mesh), dim=3)])
solid = fem.SolidBody(fem.NeoHooke(mu=b.SHEAR, bulk=b.BULK), field)
bounds = {"fixed": fem.Boundary(field[0], fz=0.0)}
dof0, dof1 = fem.dof.partition(field, bounds)
load = fem.PointLoad(field, patch, values=[0.0, 0.0, 0.0])
start = time.process_time()
for step in range(1, b.STEPS + 1):
    load.update(np.array([0.0, 0.0, -b.FORCE / len(patch) * step / b.STEPS]))
    result = fem.newtonrhapson(items=[solid, load], dof0=dof0, dof1=dof1, tol=1e-8, solver=spsolve, verbose=0)
    assert result.success
print(1e3 * (time.process_time() - start), field[0].values[patch, 2].mean())
"""


def felupe(counts):
    here = str(pathlib.Path(__file__).resolve().parent)
    known = subprocess.run([sys.executable, "-c", "import felupe, pypardiso"], capture_output=True)
    if known.returncode != 0:
        return None
    command = [sys.executable, "-c", FELUPE, here, str(list(counts))]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"FElupe failed:\n{done.stderr[-2000:]}")
    cpu, down = map(float, done.stdout.split()[-2:])
    return cpu, down


def pliant(counts, program):
    folder = pathlib.Path(__file__).resolve().parents[2]
    command = [program] if program else ["cargo", "bench", "--quiet", "--bench", "load_curve", "--"]
    command += ["--peer", f"--cells={','.join(map(str, counts))}"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    found = re.search(r"ten steps: ([\d.]+) ms .* (-[\d.]+) mm", done.stdout)
    if done.returncode != 0 or found is None:
        return None
    return float(found[1]), float(found[2])


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--cells", type=int, nargs=3, default=[7, 8, 5])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--pliant", help="the built bench, target/release/deps/load_curve-...; by cargo if not given")
    options = parser.parse_args()
    counts = tuple(options.cells)
    codes = {"pliant": lambda counts: pliant(counts, options.pliant), "CalculiX + SPOOLES": calculix, "FElupe + Pardiso": felupe}
    found = {name: [] for name in codes}
    for _ in range(options.rounds):
        for name, run in codes.items():
            answer = run(counts)
            if answer is not None:
                found[name].append(answer)
    ours = statistics.median(cpu for cpu, _ in found["pliant"]) if found["pliant"] else None
    print(f"{6 * counts[0] * counts[1] * counts[2]} tetrahedra, expected {EXPECTED.get(counts, 'unknown')} mm")
    for name, answers in found.items():
        if not answers:
            print(f"{name}: skipped, not installed or without the bench (see the top of this file)")
            continue
        cpu = statistics.median(cpu for cpu, _ in answers)
        ratio = f", {cpu / ours:.1f} times pliant" if ours else ""
        print(f"{name}: {cpu:.1f} ms of processor time{ratio}, mean patch displacement {answers[0][1]:.10f} mm")


if __name__ == "__main__":
    main()
