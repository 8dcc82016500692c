# The IR, its analysis and its simplifier.
retrograde_test(interval_test periods_test LAYERS analysis)
retrograde_test(buffer_metadata_test ir_build_test ir_scalar_test ir_text_test ir_validate_test
  TOGETHER ir_tests LAYERS ir)
retrograde_test(simplify_rules_test LAYERS simplify)
