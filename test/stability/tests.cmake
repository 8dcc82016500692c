# Small programs at the ends of the float32 range.
retrograde_test(stability_suite_test READS_FILES
  SOURCES
    stability/stability_suite_test.cpp
    stability/extremes.cpp
    stability/measure.cpp
    stability/page.cpp
    stability/problems_activations.cpp
    stability/problems_choices.cpp
    stability/problems_loops.cpp
    stability/problems_programs.cpp
    stability/problems_rational.cpp
    stability/problems_smooth.cpp
  LIBS retrograde_dep_halide_runtime)
