# How Stylet's own code is built: one interface target with the flags, one function a kind of target.

set(STYLET_ARCH x86-64-v3 CACHE STRING "Value of -march: x86-64-v3, native, ...")
set(STYLET_SANITIZE "" CACHE STRING "Value of -fsanitize=; needs clang")
option(STYLET_FUZZ "Build the fuzzers of tests/fuzz; needs clang" OFF)
option(STYLET_ASSERTIONS "Keep assert() and Eigen's checks in optimised builds" OFF)
set(STYLET_TEST_DATA "" CACHE PATH "Folder with test data from outside the project (optional)")
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()

find_program(CCACHE ccache)
if(CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # The sloppiness is what ccache asks for to cache files that use a precompiled header; by dependencies it need not
  # preprocess a file before it compiles it.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros
    CCACHE_DEPEND=1 ${CCACHE})
endif()

add_library(stylet_flags INTERFACE)
target_include_directories(stylet_flags INTERFACE ${CMAKE_SOURCE_DIR})
# By these Eigen lays out its types and takes memory. It derives them from -march, which programs that use the installed
# physics choose themselves: so they are fixed, at what x86-64-v3 has, here and by Stylet::physics there.
set(STYLET_EIGEN_LAYOUT EIGEN_MAX_ALIGN_BYTES=32 EIGEN_MAX_STATIC_ALIGN_BYTES=32)
target_compile_definitions(stylet_flags INTERFACE ${STYLET_EIGEN_LAYOUT})
# -ffp-contract=off: the same bits whatever the optimiser does (design: Determinism).
target_compile_options(stylet_flags INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
  $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>  # gcc 12 sees ghosts inside Eigen and OpenMesh
  $<$<CXX_COMPILER_ID:Clang>:-Wno-missing-field-initializers>  # anywhere, as engine/gpu says
  # In a unity clang takes what another file has for shadowed; gcc does not, nor clang in tools/lint.sh alone.
  $<$<AND:$<CXX_COMPILER_ID:Clang>,$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>>:-Wno-shadow>
  $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=1048576>  # its garbage collection walks the precompiled headers
  -Werror -march=${STYLET_ARCH} -ffp-contract=off
  -fPIC -fno-semantic-interposition  # the physics is a shared library too; precompiled headers need the same of all
  # What tests, not what is tested, is compiled in half the time; gcc gains nothing below -O1.
  $<$<BOOL:$<TARGET_PROPERTY:STYLET_TEST>>:$<IF:$<CXX_COMPILER_ID:GNU>,-O1,-O0>>)
if(STYLET_SANITIZE)
  # AddressSanitizer meets null and foreign objects itself; the fuzzers keep these checks of UBSan. UBSan leaves out what
  # libraries define (sanitizers.txt).
  target_compile_options(stylet_flags INTERFACE -fsanitize=${STYLET_SANITIZE} -fno-omit-frame-pointer -g1
    -fno-sanitize-recover=all -fsanitize-ignorelist=${CMAKE_CURRENT_LIST_DIR}/sanitizers.txt
    $<IF:$<BOOL:${STYLET_FUZZ}>,-fsanitize=fuzzer-no-link,-fno-sanitize=null$<COMMA>vptr$<COMMA>object-size>
    $<$<BOOL:$<TARGET_PROPERTY:STYLET_TEST>>:-g0>)
  target_compile_definitions(stylet_flags INTERFACE STYLET_SANITIZED)
  target_link_options(stylet_flags INTERFACE -fsanitize=${STYLET_SANITIZE})
endif()
if(STYLET_ASSERTIONS)
  target_compile_options(stylet_flags INTERFACE -UNDEBUG)
endif()
target_link_libraries(stylet_flags INTERFACE Eigen3::Eigen Threads::Threads)

# What nearly every file includes is read once. The preset dev does without: there a file that forgot an include of
# its own does not compile.
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  add_compile_options(-fpch-preprocess)  # for ccache
elseif(CMAKE_CXX_COMPILER_ID STREQUAL Clang)
  add_compile_options("SHELL:-Xclang -fno-pch-timestamp")  # for ccache
endif()
add_library(stylet_headers STATIC ${CMAKE_CURRENT_LIST_DIR}/precompiled.cpp)
target_link_libraries(stylet_headers PRIVATE stylet_flags)
# Of a library that not every build has: its header, where it is there.
set(STYLET_JSON_HEADER "$<$<TARGET_EXISTS:nlohmann_json::nlohmann_json>:<nlohmann/json.hpp$<ANGLE-R>>")
target_precompile_headers(stylet_headers PRIVATE <Eigen/Core> <Eigen/Geometry> <algorithm> <array> <cmath> <cstdint>
  <filesystem> <fmt/format.h> <functional> <memory> ${STYLET_JSON_HEADER} <optional> <span> <string> <utility> <vector>)
# Every file has to see a precompiled header with the definitions that it was made with.
add_compile_definitions($<TARGET_PROPERTY:fmt::fmt,INTERFACE_COMPILE_DEFINITIONS>)

# stylet_library(NAME SOURCES files... LINK targets...): one box of the design.
function(stylet_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK;PRIVATE_LINK" ${ARGN})
  add_library(${name} STATIC ${arg_SOURCES})
  target_link_libraries(${name} PUBLIC stylet_flags ${arg_LINK} PRIVATE ${arg_PRIVATE_LINK})
  target_precompile_headers(${name} REUSE_FROM stylet_headers)
endfunction()

# What has to be made before a file can be read by itself: SPIR-V, the commit; tools/lint.sh.
add_custom_target(generated_headers)

# What tools/test.sh builds: every test; of those with threads alone; of one folder of tests/, tests/FOLDER/all, which
# leaves out benchmarks (tools/bench.sh) and soaks.
add_custom_target(all_tests)
add_custom_target(thread_tests)
add_custom_target(all_benches)

# stylet_test(NAME SOURCES files... LINK targets... [LABEL cpu|physics|threads|gpu|bench] [TIMEOUT seconds]
# [COST seconds] [OPTIMIZED] [TOGETHER suites...] [LONG tests...] [CAMPAIGN tests...]): one GoogleTest
# executable, not optimised except where its tests compute much (it would also give its copies of a library's templates
# to what is tested). One CTest entry a test; one for all of a suite in TOGETHER, whose tests share what takes seconds to
# make and skip nothing. ThreadSanitizer runs those with the label threads. Those of higher COST, about what the longest
# takes, start first, so that nothing waits for them at the end. What is LONG, some seven seconds and more (a test, or
# SUITE.* as in TOGETHER), has the label long too: tools/test.sh leaves it to --ci. What takes a minute and has a shorter
# relative that finds most of what it finds is a CAMPAIGN, labels long and campaign: it is left to --all.
function(stylet_test name)
  cmake_parse_arguments(arg "OPTIMIZED" "TIMEOUT;LABEL;COST" "SOURCES;LINK;TOGETHER;LONG;CAMPAIGN" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  if(arg_OPTIMIZED)
    target_precompile_headers(${name} REUSE_FROM stylet_headers)
  else()
    set_target_properties(${name} PROPERTIES STYLET_TEST ON)
    target_precompile_headers(${name} REUSE_FROM stylet_test_headers)
  endif()
  target_link_libraries(${name} PRIVATE ${arg_LINK} stylet_flags GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE STYLET_SOURCE_DIR="${CMAKE_SOURCE_DIR}"
    STYLET_BINARY_DIR="${CMAKE_BINARY_DIR}")
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 900)
  endif()
  if(STYLET_SANITIZE)
    math(EXPR arg_TIMEOUT "4 * ${arg_TIMEOUT}")
  endif()
  set(environment "")
  if(STYLET_TEST_DATA)
    set(environment "ENVIRONMENT;STYLET_TEST_DATA=${STYLET_TEST_DATA}")
  endif()
  if(NOT arg_LABEL)
    set(arg_LABEL cpu)
  endif()
  if(NOT arg_COST)
    set(arg_COST 1)
  endif()
  set(properties LABELS ${arg_LABEL} TIMEOUT ${arg_TIMEOUT} COST ${arg_COST} ${environment})
  list(TRANSFORM arg_TOGETHER APPEND ".*")
  foreach(suite ${arg_TOGETHER})
    add_test(NAME ${suite} COMMAND ${name} --gtest_filter=${suite})
    set_tests_properties(${suite} PROPERTIES ${properties})
  endforeach()
  foreach(test ${arg_LONG} ${arg_CAMPAIGN})
    set(labels ${arg_LABEL} long)
    if(test IN_LIST arg_CAMPAIGN)
      list(APPEND labels campaign)
    endif()
    add_test(NAME ${test} COMMAND ${name} --gtest_filter=${test})
    set_tests_properties(${test} PROPERTIES ${properties} LABELS "${labels}" COST 30
      FAIL_REGULAR_EXPRESSION "Running 0 tests")
    if(NOT test MATCHES "\\*")  # of a suite it would hide another test's failure
      set_tests_properties(${test} PROPERTIES SKIP_REGULAR_EXPRESSION "\\[  SKIPPED \\]")
    endif()
  endforeach()
  list(JOIN arg_TOGETHER ":" together)
  set(long ${arg_LONG} ${arg_CAMPAIGN})
  list(JOIN long ":" long)
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 TEST_FILTER "-${together}:${long}" PROPERTIES ${properties})
  add_dependencies(all_tests ${name})
  if(arg_LABEL STREQUAL threads)
    add_dependencies(thread_tests ${name})
  endif()
endfunction()

# stylet_bench(NAME SOURCES files... LINK targets...): one Google Benchmark executable; tests/bench.
function(stylet_bench name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} EXCLUDE_FROM_ALL ${arg_SOURCES})
  add_dependencies(all_benches ${name})
  target_link_libraries(${name} PRIVATE ${arg_LINK} stylet_flags benchmark::benchmark)
  target_compile_definitions(${name} PRIVATE STYLET_SOURCE_DIR="${CMAKE_SOURCE_DIR}"
    STYLET_FLAGS="${CMAKE_BUILD_TYPE} -march=${STYLET_ARCH}")
endfunction()

# stylet_fuzzer(NAME SOURCES files... LINK targets...): one libFuzzer executable; preset fuzz, run by tools/fuzz.sh.
function(stylet_fuzzer name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE ${arg_LINK} stylet_flags)
  target_compile_definitions(${name} PRIVATE STYLET_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  target_link_options(${name} PRIVATE -fsanitize=fuzzer)
  add_dependencies(all_fuzzers ${name})
endfunction()
