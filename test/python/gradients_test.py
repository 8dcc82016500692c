"""Gradients, tangents, Jacobians and Hessians."""
import unittest

import numpy as np
import retrograde as rg

x, y = rg.Var("x"), rg.Var("y")


class Blur:
    """loss(kernel) = |blur(signal, kernel) - target|^2, and the same by NumPy."""

    def __init__(self):
        rng = np.random.default_rng(1)
        self.signal = rng.normal(size=66).astype(np.float32)
        self.target = rng.normal(size=64).astype(np.float32)
        self.kernel = np.array([0.2, 0.5, 0.3], np.float32)
        self.image, self.wanted = rg.Buffer(self.signal), rg.Buffer(self.target)
        self.weights = rg.ImageParam("float32", 1, "weights")
        self.weights.set(self.kernel)
        k, i = rg.RDom([(0, 3)], "k"), rg.RDom([(0, 64)], "i")
        self.blur, self.loss = rg.Func("blur"), rg.Func("loss")
        self.blur[x] += self.image[x + k] * self.weights[k]
        self.loss[()] += (self.blur[i] - self.wanted[i]) ** 2
        self.rows = np.stack([self.signal[j:j + 64] for j in range(3)], 1).astype(np.float64)

    def gradient(self):
        return 2 * self.rows.T @ (self.rows @ self.kernel - self.target)


class Adjoints(unittest.TestCase):
    def test_of_a_loss(self):
        b = Blur()
        d = rg.propagate_adjoints(b.loss)
        for gradient in (d(b.weights), d[b.weights], d.of(b.weights)):
            np.testing.assert_allclose(gradient.realize([3]), b.gradient(), rtol=1e-5)
        self.assertTrue(d.has(b.weights))
        self.assertTrue(any(f.name().startswith("blur") for f in d.funcs()))
        self.assertEqual(d.adjoint(b.blur).dimensions(), 1)
        self.assertTrue(d.accumulator(d(b.weights)).defined())

    def test_with_an_adjoint_in_memory(self):
        b = Blur()
        seed = np.arange(64, dtype=np.float32)
        d = rg.propagate_adjoints(b.blur, seed)
        np.testing.assert_allclose(d(b.weights).realize([3]), b.rows.T @ seed, rtol=1e-5)
        s = rg.Func("seed")
        s[x] = rg.f32(x)
        d = rg.propagate_adjoints(b.blur, s, [(0, 64)])
        np.testing.assert_allclose(d(b.weights).realize([3]), b.rows.T @ seed, rtol=1e-5)

    def test_several_outputs(self):
        b = Blur()
        seed, square = np.arange(64, dtype=np.float32), rg.Func("square")
        square[x] = b.blur[x] * b.blur[x]
        given = [(b.blur, rg.Func(rg.Buffer(seed)), [(0, 64)]), (square, rg.Func(rg.Buffer(seed)), [(0, 64)])]
        d = rg.propagate_adjoints(given, rg.AdjointOptions(wrt=[b.weights]))
        expected = b.rows.T @ (seed * (1 + 2 * (b.rows @ b.kernel)))
        np.testing.assert_allclose(d(b.weights).realize([3]), expected, rtol=1e-5)
        with self.assertRaisesRegex(rg.CompileError, "there is at least one output"):
            rg.propagate_adjoints([])
        with self.assertRaisesRegex(TypeError, "each output is a tuple"):
            rg.propagate_adjoints([b.blur])

    def test_options(self):
        b = Blur()
        d = rg.propagate_adjoints(b.loss, rg.AdjointOptions(wrt=[b.weights]))
        self.assertFalse(d.has(b.image))
        f, r, loss = rg.Func("f"), rg.RDom([(1, 7)]), rg.Func("loss")
        start = rg.Param("float32", "start", 0.5)
        f[()] = rg.Expr(start)
        f[()] = f[()] * f[()] + rg.f32(r) * 0
        loss[()] = f[()]
        refuse = rg.AdjointOptions(overwritten=rg.Overwritten.Refuse)
        with self.assertRaises(rg.CompileError):
            rg.propagate_adjoints(loss, refuse)
        for options in (rg.AdjointOptions(), rg.AdjointOptions(overwritten=rg.Overwritten.Store),
                        rg.AdjointOptions(checkpoint_states=2)):
            value = rg.propagate_adjoints(loss, options)(start).realize()[()]
            self.assertAlmostEqual(value, 2**7 * 0.5 ** (2**7 - 1), delta=1e-30)
        self.assertEqual(rg.AdjointOptions().version_bytes, 2**28)

    def test_explanations(self):
        b = Blur()
        unused = rg.ImageParam("float32", 1, "unused")
        d = rg.propagate_adjoints(b.loss)
        self.assertTrue(np.all(np.asarray(d(unused).realize([3])) == 0))
        zero = [e for e in d.explanations() if e.kind == rg.Explanation.Kind.Zero]
        self.assertTrue(zero and all(e.subject.startswith("unused") for e in zero))
        self.assertIn("unused", d.explain(rg.Detail.All))
        self.assertGreater(d.operations().ratio(), 1)
        self.assertGreater(d.operations().gradient.operations(), d.operations().primal.adds())
        self.assertTrue(any(e.kind == rg.Explanation.Kind.Cost for e in d.costs()))

    def test_gradients_are_differentiated_again(self):
        p = rg.Param("float64", "p", 1.5)
        f = rg.Func()
        f[()] = rg.pow(p, 3)
        for want in (3 * 1.5**2, 6 * 1.5, 6.0):
            f = rg.propagate_adjoints(f)(p)
            self.assertAlmostEqual(f.realize()[()], want, delta=1e-12)


class HalidesSpelling(unittest.TestCase):
    def test_a_func_at_a_definition_in_brackets(self):
        x, f, total, r = rg.Var("x"), rg.Func("f"), rg.Func("total"), rg.RDom([(0, 4)])
        values = rg.Buffer(np.arange(4, dtype="float32"))
        f[x] = values[x]
        f[1] *= 3.0
        total[()] += 5.0 * f[r.x]
        d = rg.propagate_adjoints(total)
        np.testing.assert_array_equal(np.asarray(d[f, -1].realize([4])), np.asarray(d[f].realize([4])))
        np.testing.assert_array_equal(np.asarray(d[f, 0].realize([4])), [5, 5, 5, 5])
        np.testing.assert_array_equal(np.asarray(d[f].realize([4])), [5, 15, 5, 5])


class Tangents(unittest.TestCase):
    def test_agree_with_adjoints(self):
        b = Blur()
        v = np.array([1, -2, 0.5], np.float32)
        direction = rg.Func("v")
        direction[x] = rg.mux(x, [1.0, -2.0, 0.5])
        for given in (v, rg.Buffer(v), direction):
            t = rg.propagate_tangents(b.loss, [(b.weights, given)])
            np.testing.assert_allclose(t(b.loss).realize()[()], b.gradient() @ v, rtol=1e-5)
        self.assertTrue(t.funcs() and t.explanations() and t.explain())
        named = rg.Direction(b.weights, direction)
        self.assertEqual(named.tangent.name(), direction.name())
        t = rg.propagate_tangents(b.blur, [named])
        np.testing.assert_allclose(t[b.blur].realize([64]), b.rows @ v, rtol=1e-4, atol=1e-5)


class Matrices(unittest.TestCase):
    def test_jacobian(self):
        b = Blur()
        j = rg.jacobian(b.blur, b.image, [(0, 64)])
        self.assertEqual((j.colours(), j.by_rows()), (3, False))
        want = np.zeros((64, 66))
        for i in range(64):
            want[i, i:i + 3] = b.kernel
        # dense()(y, x): the output's dimension first, so it is the last axis of the array.
        np.testing.assert_allclose(np.asarray(j.dense().realize([64, 66])).T, want, atol=1e-6)
        np.testing.assert_allclose(np.asarray(j.band().realize([64, 3])).T, np.tile(b.kernel, (64, 1)), atol=1e-6)
        self.assertEqual(str(j.band_offsets()[0].min), "0")
        self.assertEqual(j.compressed().dimensions(), 2)
        self.assertEqual(j.colour([x]).type(), rg.Int(32))
        rows = rg.jacobian(b.blur, b.image, [(0, 64)], rg.JacobianOptions(compression=rg.Compression.Rows))
        self.assertTrue(rows.by_rows() and rows.explain())

    def test_hessians(self):
        b = Blur()
        want = 2 * b.rows.T @ b.rows
        h = rg.hessian(b.loss, b.weights)
        np.testing.assert_allclose(h.dense().realize([3, 3]), want, rtol=1e-4, atol=1e-4)
        block = rg.hessian(b.loss, b.weights, b.weights)
        np.testing.assert_allclose(block.dense().realize([3, 3]), want, rtol=1e-4, atol=1e-4)
        diagonal = rg.hessian_diagonal(b.loss, b.weights)
        np.testing.assert_allclose(diagonal.diagonal.realize([3]), np.diag(want), rtol=1e-4)
        self.assertGreaterEqual(diagonal.colours, 1)
        v = np.array([1, 0, 2], np.float32)
        hv = rg.hessian_vector_product(b.loss, b.weights, [(b.weights, v)])
        np.testing.assert_allclose(hv.realize([3]), want @ v, rtol=1e-4)


if __name__ == "__main__":
    unittest.main()
