# SPDX-License-Identifier: Apache-2.0
# Common properties of all Warmfront targets.

if(WARMFRONT_SANITIZE)
  # No recovery: the first report fails the run. It names lines; more than these takes a fifth of the time to compile.
  add_compile_options(-fsanitize=${WARMFRONT_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer -g1)
  add_link_options(-fsanitize=${WARMFRONT_SANITIZE})
  # An index beyond a list's end is reported, too, where memory lies that the list holds spare.
  add_compile_definitions($<$<CXX_COMPILER_ID:GNU>:_GLIBCXX_ASSERTIONS>)
endif()

option(WARMFRONT_NO_TARGET_CLONES "Hot loops for the baseline instruction set only, in registers of 16 bytes: for x86-64 machines without AVX2, and to measure what the others gain" OFF)
# Function multiversioning resolves before a sanitizer's runtime is up.
if(WARMFRONT_SANITIZE OR WARMFRONT_NO_TARGET_CLONES)
  add_compile_definitions(WARMFRONT_NO_TARGET_CLONES)
endif()

if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  # For fuzzing and thread safety analysis; releases are built with GCC, which the engine's lanes are written for.
  add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:SHELL:-include ${PROJECT_SOURCE_DIR}/tests/fuzz/clang.h>")
endif()

# warmfront_target(NAME): the language level, the warnings and the include root.
function(warmfront_target name)
  target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
                                            $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/warmfront>)
  target_compile_features(${name} PUBLIC cxx_std_20)
  target_compile_options(${name} PRIVATE -Wall -Wextra -Wpedantic -Wno-psabi
                                         # GCC 12 warns of std::string's own operator+ (GCC bug 105651).
                                         $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
                                         # Branchless conditions compute both sides on purpose.
                                         $<$<CXX_COMPILER_ID:Clang>:-Wno-bitwise-instead-of-logical>
                                         # What a lock protects is touched with the lock held (server/annotations.h).
                                         $<$<CXX_COMPILER_ID:Clang>:-Wthread-safety>
                                         $<$<BOOL:${WARMFRONT_WERROR}>:-Werror>)
endfunction()

# warmfront_baseline_program(NAME SOURCES...): the program NAME once more, of these sources and what that is linked to, in
# libexec/warmfront and with the kernels for machines without AVX2.
function(warmfront_baseline_program name)
  if(NOT WARMFRONT_BASELINE_PROGRAMS)
    return()
  endif()
  add_executable(${name}_baseline ${ARGN} $<TARGET_OBJECTS:warmfront_kernels_baseline>)
  warmfront_target(${name}_baseline)
  set_target_properties(${name}_baseline PROPERTIES OUTPUT_NAME ${name} RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/libexec/warmfront)
  target_link_libraries(${name}_baseline PRIVATE $<TARGET_PROPERTY:${name},LINK_LIBRARIES>)
  add_dependencies(${name} ${name}_baseline)  # who builds the one alone can install both
  if(PROJECT_IS_TOP_LEVEL)
    install(TARGETS ${name}_baseline RUNTIME DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/warmfront COMPONENT service)
  endif()
endfunction()

# The compiler parses the headers of a whole room once and not once a file, which takes a third of the time; off, each
# file is compiled alone, as in the preset `clang`, so that each includes what it uses.
option(WARMFRONT_UNITY "Compile several source files at a time" ON)

# warmfront_compile_together(NAME COUNT): the target's files in so many groups. Which one a file is in depends on its own
# path alone, so that names that meet are those of a new file and of few others. Not for the engine's kernels and what
# tests their code.
function(warmfront_compile_together name groups)
  set_target_properties(${name} PROPERTIES UNITY_BUILD ${WARMFRONT_UNITY} UNITY_BUILD_MODE GROUP)
  get_target_property(sources ${name} SOURCES)
  foreach(source ${sources})
    cmake_path(ABSOLUTE_PATH source OUTPUT_VARIABLE path)
    cmake_path(RELATIVE_PATH path BASE_DIRECTORY ${PROJECT_SOURCE_DIR})
    string(MD5 hash "${path}")
    string(SUBSTRING "${hash}" 0 4 start)
    math(EXPR group "0x${start} % ${groups}")
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP "${group}")
  endforeach()
  # An unnamed namespace's types are as local as in a file of their own, which GCC cannot see.
  target_compile_options(${name} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endfunction()

# warmfront_parse_once(NAME HEADERS...): what most of the target's files include is parsed once for all of them; not where
# each is compiled alone.
function(warmfront_parse_once name)
  if(WARMFRONT_UNITY)
    target_precompile_headers(${name} PRIVATE ${ARGN})
  endif()
endfunction()
