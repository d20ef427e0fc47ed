"""The condensed residual of a step in CasADi, whose generated C with a dense solver is compared with that of this project.

The statements are those of the generator, translated to CasADi's graph body by body, so that both compute the same
residual; CasADi differentiates it and writes C. Unknowns are the rates and the friction forces over mu N (16 for a triple
pendulum), without the nested elimination of the latter.
"""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp

from msfp_gen import Scene, build_model
from msfp_gen.generator.derive import derive
from msfp_gen.generator.lower import needed_statements
from msfp_gen.generator.program import Program
from msfp_gen.jit.compiler import FLAGS, find_compiler
from msfp_gen.specification.layout import ModelSpec

HERE = Path(__file__).parent
Values = dict[str, Any]


def graph(expression: sp.Expr, known: dict[sp.Symbol, Any], ca: Any) -> Any:
    """A SymPy expression in CasADi."""
    if expression.is_Symbol:
        return known[expression]
    if expression.is_Number:
        return float(expression)
    parts = [graph(a, known, ca) for a in expression.args]
    name = expression.func.__name__
    if name in ("Add", "Mul"):
        total = parts[0]
        for part in parts[1:]:
            total = total + part if name == "Add" else total * part
        return total
    if name == "Pow":
        exponent = expression.args[1]
        return (
            ca.sqrt(parts[0])
            if exponent == sp.Rational(1, 2)
            else 1 / parts[0]
            if exponent == -1
            else parts[0] ** int(exponent)
        )
    return {"sin": ca.sin, "cos": ca.cos, "Modulus": ca.fabs, "Step": lambda x: ca.if_else(x > 0, 1.0, 0.0)}[name](
        *parts
    )


def results(program: Program, ca: Any, **inputs: Values) -> Values:
    """The results of a program in CasADi's graph."""
    known = {
        sp.Symbol(f"{alias}_{name}", real=True): v for alias, fields in inputs.items() for name, v in fields.items()
    }
    needed = {s for e in program.results.values() for s in e.free_symbols}
    for statement in needed_statements(program.statements, needed):
        known[statement.target] = graph(statement.expression, known, ca)
    return {name: graph(expression, known, ca) for name, expression in program.results.items()}


class Stack:
    """The residual of a spatial stack with constant friction and no rims, as a CasADi function of its unknowns."""

    def __init__(self, scene: Scene, ca: Any) -> None:
        self.ca, self.spec = ca, ModelSpec(scene.bearing.layout, scene.effects)
        self.programs = {p.name: p for p in derive(self.spec).programs}
        self.count = scene.bearing.layout.surfaces
        self.given: list[tuple[Any, str, int, str]] = []

    def parameter(self, kind: str, index: int, name: str) -> Any:
        """A parameter of the compiled function."""
        symbol = self.ca.SX.sym(f"{kind}_{index}_{name}")
        self.given.append((symbol, kind, index, name))
        return symbol

    def block(self, kind: str, index: int) -> Values:
        """All parameters of one record."""
        fields = getattr(derive(self.spec).blocks, kind).fields
        return {f.name: self.parameter(kind, index, f.name) for f in fields}

    def ground(self) -> Values:
        """Body 0, which translates without rotation."""
        fields = dict.fromkeys((f.name for f in derive(self.spec).blocks.body.fields), 0.0)
        fields |= {"t1x": 1.0, "t2y": 1.0, "t3z": 1.0, "cp": 1.0, "ct": 1.0}
        return fields | {
            name: self.parameter("base", 0, name) for name in ("Cx", "Cy", "Cz", "Vx", "Vy", "Vz", "Ax", "Ay", "Az")
        }

    def residual(self) -> tuple[Any, Any, Any]:
        """Unknowns, parameters, residual."""
        ca, n, run = self.ca, self.count, self.programs
        v, f, beta = ca.SX.sym("v", 2 * n), ca.SX.sym("f", 2 * n), self.parameter("beta", 0, "")
        bodies, xs = (
            [self.ground()],
            [dict.fromkeys(("psi", "theta", "phi", "psi1", "theta1", "phi1", "psi2", "theta2", "phi2"), 0.0)],
        )
        pars = [self.block("body_parameters", k + 1) for k in range(n)]
        for k in range(n):
            x: Values = {"phi": 0.0, "phi1": 0.0, "phi2": 0.0}
            for i, name in enumerate(("psi", "theta")):
                rate = v[2 * k + i]
                x |= {
                    name: self.parameter("Q", k, name) + beta * rate,
                    f"{name}1": rate,
                    f"{name}2": (rate - self.parameter("V", k, name)) / beta,
                }
            bodies.append(results(run["forward"], ca, par=pars[k], u=bodies[k], x=x))
            xs.append(x)
        load = {
            "Fx": self.parameter("load", 0, "x"),
            "Fy": self.parameter("load", 0, "y"),
            "Fz": self.parameter("load", 0, "z"),
        }
        none = {"Mx": 0.0, "My": 0.0, "Mz": 0.0}
        wrench = results(
            run["top_wrench"],
            ca,
            par=self.block("top_parameters", 0),
            b=bodies[n],
            x=xs[n],
            y=dict.fromkeys(("y", "y1", "beta", "mobility", "share"), 0.0),  # no vertical spring
            fe=load,
            me=none,
        )
        forces, moments = [{k: wrench[k] for k in ("Fx", "Fy", "Fz")}], [{k: wrench[k] for k in ("Mx", "My", "Mz")}]
        for k in range(n, 0, -1):
            forces.insert(0, results(run["interface_force"], ca, par=pars[k - 1], b=bodies[k], up=forces[0]))
        friction = []
        for j in range(n - 1, -1, -1):
            own, par = {"Y": f[2 * j], "Z": f[2 * j + 1]}, self.block("surface_parameters", j)
            before = {name: self.parameter("fp", j, name) for name in ("Y", "Z")}
            stage = {**before, "tau": beta + par["td"], "rest": par["td"] / (beta + par["td"])}
            local = results(
                run["surface_local"],
                ca,
                b=bodies[j],
                a=bodies[j + 1],
                x=xs[j + 1],
                y=xs[j],
                tot=forces[j],
                rim={"fx": 0.0, "fy": 0.0, "fz": 0.0},
            )
            touch = results(run["contact"], ca, par=par, h=stage, loc=local, g=own)
            moments.insert(0, results(run["moment_to_world"], ca, b=bodies[j], loc={k: touch[k] for k in none}))
            friction += [touch[name] - before[name] - beta * touch[f"d{name}"] for name in ("Y", "Z")]
        rows = []
        for k in range(1, n + 1):
            balance = results(
                run["angular_balance"],
                ca,
                par=pars[k - 1],
                b=bodies[k],
                lo=forces[k - 1],
                ml=moments[k - 1],
                up=forces[k],
                mu=moments[k],
            )
            rows += list(balance.values())[:2]
        return ca.vertcat(v, f), ca.vertcat(*(symbol for symbol, *_ in self.given)), ca.vertcat(*rows, *friction)


MAIN = """
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <string.h>
#include <time.h>
#include "msfp_model.h"
int newton(const double **arg, double **res, long long *iw, double *w, int mem);
int newton_work(long long *, long long *, long long *, long long *);
static double x[N], p[P], r[N], j[N * N], w[200000];
static double now(void) { struct timespec t; clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t); return 1e9 * (double)t.tv_sec + (double)t.tv_nsec; }
int main(void)
{
    const double *arg[] = { x, p, 0, 0 };
    double *res[] = { r, j, 0, 0 }, best = 1e30;
    int pivots[N];
    for (int i = 0; i < N; ++i) if (scanf("%lf", x + i) != 1) return 1;
    for (int i = 0; i < P; ++i) if (scanf("%lf", p + i) != 1) return 1;
    for (int b = 0; b < 15; ++b) {
        const double begin = now();
        for (int i = 0; i < 4000; ++i) {
            newton(arg, res, 0, w, 0);
            msfp_lu(j, N, pivots);
            msfp_lu_solve(j, N, pivots, r);
        }
        const double each = (now() - begin) / 4000;
        best = each < best ? each : best;
    }
    newton(arg, res, 0, w, 0);
    printf("%.1f", best);
    for (int i = 0; i < N; ++i) printf(" %.17g", r[i]);
    return 0;
}
"""


def timed(
    scene: Scene, numbers: dict[tuple[str, int, str], float], unknowns: Any, folder: Path, flags: tuple[str, ...] = ()
) -> tuple[float, Any]:
    """Time of one Newton iteration by CasADi's C and LU with pivoting [ns], and the residual."""
    import casadi as ca

    stack = Stack(scene, ca)
    x, p, r = stack.residual()
    function = ca.Function("newton", [x, p], [r, ca.densify(ca.jacobian(r, x))])
    generator = ca.CodeGenerator("newton.c", {"with_header": False})
    generator.add(function)
    generator.generate(f"{folder}/")
    (folder / "main.c").write_text(MAIN)
    built = build_model(scene.bearing.layout, scene.effects).info.folder
    sizes = [f"-DN={x.numel()}", f"-DP={p.numel()}", "-I", str(built), "-w"]
    sources = [str(folder / "main.c"), str(folder / "newton.c"), str(built / "linear.c")]
    subprocess.run(
        [
            *find_compiler().command,
            *FLAGS["c"],
            *FLAGS["user"],
            *flags,
            *sizes,
            *sources,
            "-o",
            str(folder / "peer"),
            "-lm",
        ],
        check=True,
    )
    values = [*unknowns, *(numbers[key] for _, *rest in stack.given for key in [tuple(rest)])]
    done = subprocess.run(
        [folder / "peer"], input=" ".join(repr(float(v)) for v in values), text=True, capture_output=True, check=True
    )
    words = done.stdout.split()
    return float(words[0]), np.array(words[1:], dtype=float)
