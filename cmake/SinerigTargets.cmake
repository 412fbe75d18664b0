# Every target of the project is made by the functions below, so that
# warnings, sanitizers and include paths are stated once.

if(CMAKE_BUILD_TYPE STREQUAL Release AND CMAKE_CXX_COMPILER_ID STREQUAL GNU AND NOT SINERIG_SANITIZE)
  set(SINERIG_WHOLE_PROGRAM ON)
endif()

function(sinerig_options target)
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wold-style-cast
    $<$<BOOL:${SINERIG_STRICT}>:-Werror>)
  # Only the preset `rtsan` meets a clang this new: it calls deprecated what libstdc++'s own algorithms
  # use, and __COUNTER__, in Google Benchmark's macros, an extension.
  if(CMAKE_CXX_COMPILER_ID STREQUAL Clang AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 22)
    target_compile_options(${target} PRIVATE -Wno-deprecated-declarations -Wno-c2y-extensions)
  endif()
  target_include_directories(${target} PUBLIC "${PROJECT_SOURCE_DIR}/src" "${PROJECT_SOURCE_DIR}")
  # Bit-identical runs need one rounding rule: no contraction into fused multiply-adds.
  target_compile_options(${target} PRIVATE -ffp-contract=off)
  if(SINERIG_SANITIZE)
    target_compile_options(${target} PUBLIC
      -fsanitize=${SINERIG_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer -O1)
    target_link_options(${target} PUBLIC -fsanitize=${SINERIG_SANITIZE})
    # What a sanitizer adds hides from g++ what has been initialised (<regex> of libstdc++ 12).
    if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
      target_compile_options(${target} PRIVATE -Wno-maybe-uninitialized)
    endif()
  endif()
endfunction()

# sinerig_library(NAME SOURCES a.cpp … LINK libs …)
function(sinerig_library name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  add_library(${name} STATIC ${arg_SOURCES})
  sinerig_options(${name})
  target_link_libraries(${name} PUBLIC ${arg_LINK})
endfunction()

# The library is part of every tick: its calls are to be inlined across its files where the whole
# program is linked that way (sinerig_fast), a tenth of what a tick costs. Other programs link the
# ordinary code that lies beside it, without the wait.
function(sinerig_in_the_loop library)
  if(SINERIG_WHOLE_PROGRAM)
    # Nobody reads errno of the mathematics or traps on it; no result depends on it.
    target_compile_options(${library} PRIVATE
      -flto=auto -ffat-lto-objects -fno-math-errno -fno-trapping-math)
  endif()
endfunction()
function(sinerig_fast program)
  if(SINERIG_WHOLE_PROGRAM)
    target_compile_options(${program} PRIVATE -flto=auto)
    target_link_options(${program} PRIVATE -O3 -flto=auto)
  endif()
endfunction()

# sinerig_test(NAME LABEL unit|unit-loop|system|bench SOURCES a.cpp … LINK libs … [ARGS …])
# One GoogleTest binary, each test case registered under the label.
function(sinerig_test name)
  cmake_parse_arguments(arg "" "LABEL" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${arg_SOURCES})
  sinerig_options(${name})
  target_link_libraries(${name} PRIVATE ${arg_LINK} GTest::gmock_main)
  target_compile_definitions(${name} PRIVATE
    SINERIG_SOURCE_DIR="${PROJECT_SOURCE_DIR}" SINERIG_BINARY="${PROJECT_BINARY_DIR}/sinerig")
  set(suppressions "${PROJECT_SOURCE_DIR}/cmake/tsan_suppressions.txt")
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60 PROPERTIES LABELS ${arg_LABEL} TIMEOUT 600
    ENVIRONMENT TSAN_OPTIONS=suppressions=${suppressions})
endfunction()
