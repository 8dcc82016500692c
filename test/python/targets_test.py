"""Types and Targets."""
import unittest

import numpy as np
import retrograde as rg


class Types(unittest.TestCase):
    def test_facts(self):
        t = rg.UInt(8, 4)
        self.assertEqual((t.code(), t.bits(), t.bytes(), t.lanes()), (rg.TypeCode.UInt, 8, 1, 4))
        self.assertTrue(t.is_uint() and t.is_vector() and t.is_int_or_uint() and not t.is_scalar())
        self.assertTrue(rg.Bool().is_bool() and rg.BFloat(16).is_bfloat() and rg.Handle().is_handle())
        self.assertTrue(rg.Int(8).is_int() and rg.Float(16).is_float())
        self.assertEqual(t.element_of(), rg.UInt(8))
        self.assertEqual(rg.Int(16).widen().narrow(), rg.Int(16))
        self.assertEqual((rg.Int(8).with_bits(32), rg.Int(8).with_lanes(2), rg.Int(8).with_code(rg.Type.UInt)),
                         (rg.Int(32), rg.Int(8, 2), rg.UInt(8)))
        self.assertEqual((rg.Int(8).min_int(), rg.Int(8).max_int(), rg.UInt(64).max_uint()), (-128, 127, 2**64 - 1))
        self.assertEqual((str(rg.UInt(8).max()), str(rg.Int(8).min())), ("255_u8", "-128_i8"))
        self.assertTrue(rg.Int(16).can_overflow_int() and rg.UInt(32).can_overflow())
        self.assertTrue(rg.Int(8).same_handle_type(rg.Int(8)))

    def test_what_a_type_holds(self):
        t = rg.Int(8)
        self.assertEqual([t.can_represent(v) for v in (127, 128, 2**64, -2**70, rg.UInt(8), rg.Bool())],
                         [True, False, False, False, False, True])
        self.assertTrue(rg.UInt(64).can_represent(2**64 - 1))
        self.assertFalse(rg.Float(16).can_represent(1e9))
        self.assertTrue(t.is_max(127) and t.is_min(-128) and not t.is_max(1))

    def test_names(self):
        self.assertEqual(rg.Type("float32"), rg.Float(32))
        self.assertEqual(rg.Type(np.float16), rg.Float(16))
        self.assertEqual(rg.type_of(np.dtype("uint8")), rg.UInt(8))
        self.assertEqual(len({rg.Int(8), rg.Int(8), rg.Int(16)}), 2)
        self.assertTrue(rg.Int(8) < rg.Int(16))
        for wrong in ("float8", "complex64", 3):
            with self.assertRaises(TypeError):
                rg.Type(wrong)


class Targets(unittest.TestCase):
    def test_text(self):
        t = rg.Target("x86-64-linux-avx2-fma")
        self.assertEqual(str(t), t.to_string())
        self.assertEqual((t.os, t.arch, t.bits), (rg.Target.OS.Linux, rg.Target.Arch.X86, 64))
        self.assertTrue(t.has_feature(rg.Target.Feature.AVX2))
        self.assertEqual(rg.Target(str(t)), t)
        self.assertEqual(t, rg.Target(rg.Target.OS.Linux, rg.Target.Arch.X86, 64,
                                      [rg.Target.Feature.AVX2, rg.Target.Feature.FMA]))
        self.assertEqual(repr(t), f"Target('{t}')")
        self.assertTrue(rg.Target.validate_target_string("host"))
        self.assertFalse(rg.Target.validate_target_string("no-such-thing"))
        with self.assertRaises(rg.CompileError):
            rg.Target("no-such-thing")

    def test_features(self):
        feature = rg.Target.Feature
        t = rg.Target("x86-64-linux").with_feature(feature.AVX2)
        self.assertFalse(t.without_feature(feature.AVX2).has_feature(feature.AVX2))
        self.assertTrue(t.features_any_of([feature.AVX2, feature.CUDA]))
        self.assertFalse(t.features_all_of([feature.AVX2, feature.CUDA]))
        t.set_features([feature.SSE41])
        t.set_implied_features()
        self.assertTrue(t.has_feature(feature.FMA))
        t.unset_implied_features()
        t.set_feature(feature.SSE41, False)
        self.assertEqual(rg.Target.feature_to_name(feature.AVX2), "avx2")
        self.assertEqual(rg.Target.feature_from_name("avx2"), feature.AVX2)

    def test_of_this_machine(self):
        host = rg.get_host_target()
        self.assertTrue(host.supported() and not host.has_unknowns() and not host.has_gpu_feature())
        self.assertGreaterEqual(host.natural_vector_size("float32"), 4)
        self.assertTrue(host.supports_type(rg.Float(32)) and host.supports_type(rg.Float(32), rg.DeviceAPI.Host))
        self.assertEqual(rg.Target("host-cuda-cuda_capability_80").cuda_capability(), 80)
        self.assertEqual(rg.Target("host-opencl").unsupported_part(), "opencl")
        self.assertEqual(host.get_runtime_compatible_target(host).bits, 64)
        self.assertEqual(rg.get_jit_target_from_environment().arch, host.arch)
        self.assertEqual(rg.get_target_from_environment().os, host.os)

    def test_a_text_stands_for_a_target(self):
        x, f = rg.Var("x"), rg.Func()
        f[x] = x
        np.testing.assert_array_equal(f.realize([3], "host-no_asserts"), [0, 1, 2])
        with self.assertRaises(rg.Unsupported):
            f.realize([3], "arm-64-linux")


if __name__ == "__main__":
    unittest.main()
