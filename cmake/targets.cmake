# Compile options every target of the project gets, and the two ways to declare a folder.

add_library(grapnel_options INTERFACE)
target_compile_features(grapnel_options INTERFACE cxx_std_20)
target_include_directories(grapnel_options INTERFACE ${CMAKE_SOURCE_DIR})
# The same bits on every machine: no contraction of a*b+c, no value-changing optimisation.
target_compile_options(grapnel_options INTERFACE -ffp-contract=off
  -Wall -Wextra -Wconversion -Wshadow -Wold-style-cast)
if(GRAPNEL_WERROR)
  target_compile_options(grapnel_options INTERFACE -Werror)
endif()
if(GRAPNEL_SANITIZE)
  target_compile_options(grapnel_options INTERFACE -fsanitize=${GRAPNEL_SANITIZE} -fno-omit-frame-pointer)
  target_link_options(grapnel_options INTERFACE -fsanitize=${GRAPNEL_SANITIZE})
  if(GRAPNEL_SANITIZE MATCHES "undefined")
    target_compile_options(grapnel_options INTERFACE -fno-sanitize-recover=undefined)
  endif()
endif()
if(GRAPNEL_FUZZ)
  target_compile_options(grapnel_options INTERFACE -fsanitize=fuzzer-no-link)
endif()

# Headers that most files read, parsed once for all libraries (with grapnel_base) and once for all tests (with
# the layering test): near a half of a build's time. Only where they fit every target: clang refuses another
# target's over a macro of its own.
set(GRAPNEL_COMMON_HEADERS <algorithm> <array> <cmath> <cstdint> <filesystem> <fstream> <functional> <map>
  <memory> <optional> <span> <sstream> <string> <string_view> <utility> <vector> <Eigen/Core> <Eigen/Geometry>)
# grapnel_precompile(TARGET OWNER [HEADERS …]): the owner's own, or from it.
function(grapnel_precompile target owner)
  if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    return()
  endif()
  if(target STREQUAL owner)
    target_precompile_headers(${target} PRIVATE ${GRAPNEL_COMMON_HEADERS} ${ARGN})
  else()
    target_precompile_headers(${target} REUSE_FROM ${owner})
  endif()
endfunction()

# grapnel_library(NAME [LIBS …]): a static library of every .cpp below the calling folder.
function(grapnel_library name)
  cmake_parse_arguments(ARG "" "" "LIBS" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  if(sources)
    add_library(${name} STATIC ${sources})
    target_link_libraries(${name} PUBLIC grapnel_options ${ARG_LIBS})
    grapnel_precompile(${name} grapnel_base)
  else()
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE grapnel_options ${ARG_LIBS})
  endif()
endfunction()

# grapnel_camera_plugin(NAME [LIBS …]): libgrapnel_camera_NAME.so of every .cpp in the calling folder. It
# stays loaded for good: a thread that hangs in a capture library still needs its code.
function(grapnel_camera_plugin name)
  cmake_parse_arguments(ARG "" "" "LIBS" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  add_library(grapnel_camera_${name} MODULE ${sources})
  target_link_libraries(grapnel_camera_${name} PRIVATE grapnel_options grapnel_live ${ARG_LIBS})
  target_link_options(grapnel_camera_${name} PRIVATE -Wl,-z,nodelete -Wl,--exclude-libs,ALL)
  set_target_properties(grapnel_camera_${name} PROPERTIES
    LIBRARY_OUTPUT_DIRECTORY ${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/cameras)
  install(TARGETS grapnel_camera_${name} DESTINATION ${CMAKE_INSTALL_LIBDIR}/grapnel/cameras)
endfunction()

# grapnel_test(NAME LABEL unit|contract|… [LIBS …]): one GoogleTest program of every .cpp directly in the
# calling folder and below, its cases registered one by one with ctest.
function(grapnel_test name)
  cmake_parse_arguments(ARG "" "LABEL;TIMEOUT" "LIBS;SOURCES;ENV" ${ARGN})
  if(NOT ARG_SOURCES)
    file(GLOB_RECURSE ARG_SOURCES CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  endif()
  if(NOT ARG_SOURCES)
    return()
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE grapnel_options ${ARG_LIBS} GTest::gmock GTest::gtest_main)
  # Half of a build is tests; what they test is optimised, they themselves need not be. So optimised GCC 12
  # takes its own library's strings for overflows.
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${name} PRIVATE -Wno-array-bounds -Wno-restrict -Wno-stringop-overflow)
  endif()
  grapnel_precompile(${name} grapnel_layering_test <gtest/gtest.h>)
  target_compile_definitions(${name} PRIVATE GRAPNEL_SOURCE_DIR="${CMAKE_SOURCE_DIR}"
    GRAPNEL_BINARY_DIR="${CMAKE_BINARY_DIR}")
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 60
    PROPERTIES LABELS ${ARG_LABEL} TIMEOUT ${ARG_TIMEOUT})
endfunction()
