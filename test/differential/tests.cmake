# The same pipelines, compiled by Halide and by Retrograde.
retrograde_test(differential_test
  SOURCES differential/differential_test.cpp differential/halide_side.cpp differential/retrograde_side.cpp
  LIBS retrograde_dep_halide SHARDS 8 TIMEOUT 900)
