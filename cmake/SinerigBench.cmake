# Tests that need a CAN bus, GPIO lines or virtual time run inside tools/virtual-bench: label `bench`.
# Where it cannot be had they are skipped and print the reason (SINERIG_REQUIRE_BENCH=1 makes that a failure).

add_test(NAME bench_kernel COMMAND ${PROJECT_SOURCE_DIR}/tools/virtual-bench --prepare)
set_tests_properties(bench_kernel PROPERTIES
  LABELS bench FIXTURES_SETUP bench_kernel TIMEOUT 3000 SKIP_RETURN_CODE 125)

function(sinerig_bench_properties test)
  set(label bench)
  if(ARGC GREATER 1)
    set(label ${ARGV1})
  endif()
  set_tests_properties(${test} PROPERTIES
    LABELS ${label} FIXTURES_REQUIRED bench_kernel TIMEOUT 600 SKIP_RETURN_CODE 125)
endfunction()

# sinerig_bench_test(NAME [LABEL bench-loop] SOURCES a.cpp … LINK libs …)
# One GoogleTest binary, run as a whole on one fresh bus. The address space of the bench's kernel is too
# small for the shadow memory of the address and thread sanitizers.
function(sinerig_bench_test name)
  cmake_parse_arguments(arg "" "LABEL" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  sinerig_options(${name})
  target_link_libraries(${name} PRIVATE ${arg_LINK} GTest::gmock_main)
  target_compile_definitions(${name} PRIVATE
    SINERIG_SOURCE_DIR="${PROJECT_SOURCE_DIR}" SINERIG_BINARY="${PROJECT_BINARY_DIR}/sinerig")
  if(SINERIG_SANITIZE MATCHES "address|thread")
    add_test(NAME ${name} COMMAND ${CMAKE_COMMAND} -E echo
      "skipped: the kernel of the bench has no room for -fsanitize=${SINERIG_SANITIZE}")
    set_tests_properties(${name} PROPERTIES LABELS bench SKIP_REGULAR_EXPRESSION "^skipped:")
  else()
    add_test(NAME ${name}
      COMMAND ${PROJECT_SOURCE_DIR}/tools/virtual-bench --timeout 500 $<TARGET_FILE:${name}>)
    sinerig_bench_properties(${name} ${arg_LABEL})
  endif()
endfunction()
