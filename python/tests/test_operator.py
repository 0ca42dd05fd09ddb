"""K as SciPy's LinearOperator: transposes, multiples, sums, powers and solvers; and without SciPy."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import halflight as hl

linalg = pytest.importorskip("scipy.sparse.linalg")


@pytest.fixture(scope="module")
def K(solved: hl.Solution) -> hl.Operator:
    return solved.operator


def dense(K: hl.Operator) -> np.ndarray:
    """K by its blocks, in double precision: (6 n, 6 n)."""
    n = K.shape[0]
    whole = np.zeros((n, n))
    for channel in range(3):
        whole[channel::3, channel::3] = K.matrix(channel).toarray()
    return whole


def test_k_is_a_linear_operator(K: hl.Operator) -> None:
    assert isinstance(K, linalg.LinearOperator) and issubclass(hl.Operator, linalg.LinearOperator)
    assert linalg.aslinearoperator(K) is K and K.dtype == np.float32


def test_what_is_made_of_k_is_what_is_made_of_its_matrix(K: hl.Operator) -> None:
    whole, rng = dense(K), np.random.default_rng(3)
    x, many = rng.random(K.shape[0]), rng.random((K.shape[0], 3))
    made = [
        (K, whole),
        (K.T, whole.T),
        (K.H, whole.T),
        (K.adjoint(), whole.T),
        (K.T.T, whole),
        (2 * K, 2 * whole),
        (-K, -whole),
        (K + K, 2 * whole),
        (K**2, whole @ whole),
        (K @ K, whole @ whole),
        ((2 * K).T, 2 * whole.T),
        (linalg.aslinearoperator(np.eye(K.shape[0], dtype=np.float32)) - K, np.eye(K.shape[0]) - whole),
    ]
    for operator, matrix in made:
        scale = np.abs(matrix @ x).max()
        assert np.allclose(operator @ x, matrix @ x, atol=1e-5 * scale)
        assert np.allclose(operator.matmat(many), matrix @ many, atol=1e-5 * scale)
        assert np.allclose(operator.rmatvec(x), matrix.T @ x, atol=1e-5 * scale)
    assert np.allclose(K.rmatmat(many), whole.T @ many, atol=1e-5) and np.allclose(K.dot(x), whole @ x, atol=1e-5)


def test_solvers_take_it_as_it_is(K: hl.Operator, solved: hl.Solution) -> None:
    b = K.first_bounce.ravel()
    one = linalg.aslinearoperator(np.eye(len(b), dtype=np.float32))
    reflected = (solved.light - K.emission).ravel()
    for solver in (linalg.gmres, linalg.bicgstab):
        x, info = solver(one - K, b, rtol=1e-5, maxiter=100)
        assert info == 0 and np.linalg.norm(x - reflected) < 1e-3 * np.linalg.norm(reflected)
    largest = linalg.eigs(K, k=1, return_eigenvectors=False, tol=1e-4)[0]
    assert solved.radius[0] * 0.998 <= abs(largest) <= solved.radius[1] * 1.002
    # Singular values need the transpose: (1 - K) has an inverse, so the least is above 0.
    values = linalg.svds(one - K, k=1, which="LM", return_singular_vectors=False, tol=1e-3)
    assert values[0] == pytest.approx(np.linalg.norm(np.eye(len(b)) - dense(K), 2), rel=1e-2)


def test_the_words_on_precision_hold(K: hl.Operator) -> None:
    assert "rtol`` of 1e-5 or more" in (hl.Operator.__doc__ or "")
    whole = dense(K)
    x = np.random.default_rng(5).random(K.shape[0])
    exact = whole @ x
    seen = exact > 0
    relative = np.abs((K @ x)[seen] / exact[seen] - 1)
    # Single precision: far above 1e-12, and some roundings of 6e-8 wide.
    assert 1e-9 < relative.max() < 2e-5
    double = K.matrix(0).astype(float)
    assert np.abs((double @ x[::3])[seen[::3]] / exact[::3][seen[::3]] - 1).max() < 1e-12


CODE = """
import sys
sys.modules["scipy"] = sys.modules["scipy.sparse"] = sys.modules["scipy.sparse.linalg"] = None
import numpy as np, halflight as hl
K = hl.solve(hl.cornell_box(), patches=100, rays=16).operator
x = K.first_bounce
print(np.array_equal(K @ x, K.matvec(x)), K.matmat(np.ones((K.shape[0], 2))).shape == (K.shape[0], 2))
"""


def test_products_need_no_scipy() -> None:
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True)
    assert done.stdout.strip() == "True True", done.stderr
