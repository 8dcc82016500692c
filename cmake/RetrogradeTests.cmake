# retrograde_test(<name>... [SOURCES <file>...] [LAYERS <layer>...] [LIBS <target>...] [LABELS <label>]
#   [TIMEOUT <seconds>] [SHARDS <n>] [CACHED] [OPTIMIZED] [READS_FILES] [ALONE]
#   [EXPORTS] [RUNTIME] [TOGETHER <program>])
#
# Declares GoogleTest programs that are alike. The source of each is <name>.cpp beside the list that calls this, unless
# SOURCES names others, relative to CMAKE_CURRENT_SOURCE_DIR. ctest lists the tests of a program one by one; with
# RETROGRADE_QUICK_TESTS it runs each program once, because a process needs a tenth of a second to load LLVM.
#
# LAYERS       Link only these layers (ir, simplify ...) and what lies below them, instead of the shared library: such a
#              test builds while a layer above is broken.
# LIBS         Further targets (retrograde_dep_halide, retrograde_dep_json ...).
# LABELS       The default is the first folder of the first source.
# SHARDS       ctest lists <name>.shard_0, <name>.shard_1 ..., each a process that runs its share of the tests: for a
#              program that takes longer to start than most of its tests to run.
# CACHED       The test and the programs that it starts keep their machine code in one folder of the build
#              (RETROGRADE_CACHE_DIR): for tests that compile the same large pipelines again and again.
# OPTIMIZED    The test itself computes much; see RETROGRADE_QUICK_TESTS.
# READS_FILES  Define RETROGRADE_TEST_DIR as the folder of the tests. Only on request: a path among the flags keeps
#              ccache from sharing objects between checkouts.
# ALONE        The test measures time and runs beside no other.
# EXPORTS      Compiled pipelines call C functions of the test program.
# RUNTIME      The test includes headers of runtime/.
# TOGETHER     With RETROGRADE_QUICK_TESTS these tests are one program, which units of several of its files make: what
#              all of them include takes most of the compile time. The files share one namespace then.
include(GoogleTest)

# With RETROGRADE_QUICK_TESTS, the headers that nearly every test includes are compiled once for all of them.
# retrograde_precompiled(<name> <header>...) adds a target that holds them; no one runs it. It needs the libraries and
# definitions of its users, which call retrograde_use_precompiled(<target> <name>).
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/test/headers.cpp CONTENT "int main() {}" @ONLY)
function(retrograde_precompiled name)
  # A program, as the tests are: position-independent code of libraries is compiled otherwise.
  add_executable(${name} ${PROJECT_BINARY_DIR}/test/headers.cpp)
  target_compile_options(${name} PRIVATE -O0)
  target_precompile_headers(${name} PRIVATE ${ARGN})
endfunction()
function(retrograde_use_precompiled target name)
  if(TARGET ${name})
    target_precompile_headers(${target} REUSE_FROM ${name})
  endif()
endfunction()

function(retrograde_test)
  cmake_parse_arguments(PARSE_ARGV 0 arg "CACHED;OPTIMIZED;READS_FILES;ALONE;EXPORTS;RUNTIME"
    "TIMEOUT;SHARDS;TOGETHER" "SOURCES;LAYERS;LIBS;LABELS")
  file(RELATIVE_PATH folder ${CMAKE_CURRENT_SOURCE_DIR} ${CMAKE_CURRENT_LIST_DIR})
  set(names ${arg_UNPARSED_ARGUMENTS})
  if(arg_TOGETHER AND RETROGRADE_QUICK_TESTS)
    retrograde_test_units(${names})
    set(names ${arg_TOGETHER})
  endif()
  foreach(name ${names})
    set(sources ${arg_SOURCES})
    if(NOT sources)
      set(sources ${folder}/${name}.cpp)
    endif()
    set(label ${arg_LABELS})
    if(NOT label)
      list(GET sources 0 first)
      string(REGEX REPLACE "/.*" "" label "${first}")
    endif()
    add_executable(${name} ${sources})
    retrograde_compile_test(${name})
    retrograde_list_test(${name})
  endforeach()
endfunction()

# The units and shards of a program of several tests; a part of retrograde_test that sets its arguments.
function(retrograde_test_units)
  set(files ${ARGN})
  list(TRANSFORM files APPEND .cpp)
  set(retrograde_files_per_unit 4)
  retrograde_units(${arg_TOGETHER}_units ${folder}/ ${files})
  set(arg_SOURCES ${${arg_TOGETHER}_units} PARENT_SCOPE)
  if(NOT arg_LABELS)
    string(REGEX REPLACE "/.*" "" first_folder "${folder}")
    set(arg_LABELS ${first_folder} PARENT_SCOPE)
  endif()
  list(LENGTH files count)
  math(EXPR shards "(${count} + 3) / 4")
  set(arg_SHARDS ${shards} PARENT_SCOPE)
endfunction()

# The flags and libraries of one program; a part of retrograde_test that reads its arguments.
function(retrograde_compile_test name)
  if(arg_OPTIMIZED)
    target_compile_options(${name} PRIVATE -O2)
  elseif(RETROGRADE_QUICK_TESTS AND NOT label STREQUAL "property")
    target_compile_options(${name} PRIVATE -O0)
    if(arg_LAYERS)
      retrograde_use_precompiled(${name} retrograde_layer_test_headers)
    elseif(NOT "retrograde_dep_halide" IN_LIST arg_LIBS)
      retrograde_use_precompiled(${name} retrograde_test_headers)
    endif()
  endif()
  set(library retrograde)
  if(arg_LAYERS)
    list(TRANSFORM arg_LAYERS PREPEND retrograde_ OUTPUT_VARIABLE library)
  endif()
  target_link_libraries(${name} PRIVATE ${arg_LIBS} ${library} GTest::gtest_main)
  target_include_directories(${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
  if(arg_RUNTIME)
    target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR}/runtime)
  endif()
  if(arg_EXPORTS)
    set_target_properties(${name} PROPERTIES ENABLE_EXPORTS ON)
  endif()
  if(arg_READS_FILES)
    target_compile_definitions(${name} PRIVATE RETROGRADE_TEST_DIR="${CMAKE_CURRENT_SOURCE_DIR}")
  endif()
endfunction()

# The properties that ctest has of one program; a part of retrograde_test that reads its arguments.
function(retrograde_list_test name)
  set(timeout 300)
  if(arg_TIMEOUT)
    set(timeout ${arg_TIMEOUT})
  endif()
  set(properties LABELS "${label}" TIMEOUT ${timeout} RUN_SERIAL ${arg_ALONE})
  if(arg_CACHED)
    list(APPEND properties
      ENVIRONMENT_MODIFICATION "RETROGRADE_CACHE_DIR=set:${PROJECT_BINARY_DIR}/test/compile_cache")
  endif()
  set(environment
    "LSAN_OPTIONS=print_suppressions=0:suppressions=${CMAKE_CURRENT_SOURCE_DIR}/leaks_of_others.supp")
  if(arg_SHARDS)
    math(EXPR last "${arg_SHARDS} - 1")
    foreach(shard RANGE ${last})
      add_test(NAME ${name}.shard_${shard} COMMAND ${name})
      set_tests_properties(${name}.shard_${shard} PROPERTIES ${properties}
        ENVIRONMENT "${environment};GTEST_TOTAL_SHARDS=${arg_SHARDS};GTEST_SHARD_INDEX=${shard}")
    endforeach()
  elseif(RETROGRADE_QUICK_TESTS)
    add_test(NAME ${name} COMMAND ${name})
    set_tests_properties(${name} PROPERTIES ${properties} ENVIRONMENT "${environment}")
  else()
    # PRE_TEST: the program is asked for its tests when ctest runs, not on every link.
    gtest_discover_tests(${name} TEST_PREFIX "${name}." DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60
      PROPERTIES ${properties} ENVIRONMENT "${environment}")
  endif()
endfunction()

# retrograde_many_programs(<name> ...), with the arguments of retrograde_test: a test again, with all of the programs
# of which it runs a part by default.
function(retrograde_many_programs name)
  retrograde_test(${name} ${ARGN} LABELS fuzz TIMEOUT 1800)
  target_compile_definitions(${name} PRIVATE RETROGRADE_MANY_PROGRAMS)
endfunction()

# retrograde_fuzz(<program> FROM <first> TO <last> STEP <count> [OPTIONS <option>...]): one test for each `count` of the
# program's seeds.
function(retrograde_fuzz program)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "FROM;TO;STEP" "OPTIONS")
  foreach(first RANGE ${arg_FROM} ${arg_TO} ${arg_STEP})
    add_test(NAME ${program}.from_${first}
      COMMAND ${program} --from ${first} --count ${arg_STEP} ${arg_OPTIONS})
    set_tests_properties(${program}.from_${first} PROPERTIES LABELS fuzz TIMEOUT 1800)
  endforeach()
endfunction()
