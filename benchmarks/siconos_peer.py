"""Siconos as peer, run by the Python that Debian's python3-siconos belongs to.

    /usr/bin/python3 benchmarks/siconos_peer.py < problem.json

Reads a problem as `impact_peers.siconos` writes it and prints its impacts and the time they took.
The harmonic base is a degree of freedom of its own (an oscillator nobody acts on), so that all
forces are linear and nothing has to be called back.
"""

import json
import sys
import time

import numpy as np
import siconos.kernel as sk

HEAVY = 1e10
NONSMOOTH = 2  # type of an event at which an impact is solved


def build(p, step):
    """Mass, base and balls as one linear Lagrangian system; one interaction per wall."""
    n = 2 + len(p["m"])
    mass, damping, stiffness = np.diag([p["M"], 1.0, *p["m"]]), np.zeros((n, n)), np.zeros((n, n))
    damping[0, :2], stiffness[0, :2] = [p["c"], -p["c"]], [p["k"], -p["k"]]
    stiffness[1, 1] = p["omega"] ** 2
    G, phase = p["amplitude"], p["phase"]
    q = [p["start"][0], G * np.sin(phase), *p["start"][2::2]]
    v = [p["start"][1], G * p["omega"] * np.cos(phase), *p["start"][3::2]]
    system = sk.LagrangianLinearTIDS(q, v, mass, stiffness, damping)
    model = sk.NonSmoothDynamicalSystem(0.0, p["duration"])
    model.insertDynamicalSystem(system)
    walls, kept = [], []
    for i, (clearance, r) in enumerate(zip(p["b"], p["r"], strict=True)):
        for side in (1, -1):
            b = clearance
            H = np.zeros((1, n))
            H[0, 0], H[0, 2 + i] = -side, side
            if p["m"][i] > HEAVY * p["M"]:  # a wall that stays where it is, given to Siconos as one
                b, H[0, 2 + i] = b + side * p["start"][2 + 2 * i], 0.0
            law, relation = sk.NewtonImpactNSL(r), sk.LagrangianLinearTIR(H, [b])
            interaction = sk.Interaction(law, relation)
            model.link(interaction, system)
            walls.append((i, side, H[0], b))
            kept.append((law, relation, interaction))
    simulation = sk.EventDriven(model, sk.TimeDiscretisation(0.0, step), 0)
    integrator, impact, force = sk.LsodarOSI(), sk.LCP(), sk.LCP()
    simulation.insertIntegrator(integrator)
    simulation.insertNonSmoothProblem(impact, sk.SICONOS_OSNSP_ED_IMPACT)
    simulation.insertNonSmoothProblem(force, sk.SICONOS_OSNSP_ED_SMOOTH_ACC)
    kept.append((model, integrator, impact, force))
    return simulation, system, walls, kept


def run(p, step, limit):
    """Impacts (time, ball, side) and the processor seconds of the time loop."""
    simulation, system, walls, _kept = build(p, step)
    events, found = simulation.eventsManager(), []
    begin = time.process_time()
    while simulation.hasNextEvent() and len(found) < limit:
        try:
            simulation.advanceToEvent()
            simulation.processEvents()
        except Exception as failure:  # it has no class of its own
            print(f"stops at {simulation.startingTime()}: {failure}", file=sys.stderr)
            break
        if events.currentEvent().getType() == NONSMOOTH:
            q = system.q()
            gaps = [abs(b + H @ q) for _i, _side, H, b in walls]
            i, side = walls[int(np.argmin(gaps))][:2]
            found.append((simulation.startingTime(), i, side))
    return found, time.process_time() - begin


def main():
    p = json.load(sys.stdin)
    runs = [run(p, p["step"], p["limit"]) for _ in range(3)]
    seconds = min(seconds for _found, seconds in runs)
    print("IMPACTS " + json.dumps({"impacts": runs[0][0], "seconds": seconds}))


main()
