#Plans of the autoscheduler.
retrograde_test(plan_covers_test plan_import_test plan_text_test plan_validate_test TOGETHER plan_tests LIBS
                    retrograde_dep_halide_runtime)
