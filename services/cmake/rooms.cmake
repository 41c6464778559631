# The only CMake functions of the project. A room is one folder and one static library; a program is a house's
# main.cpp with its rooms; a check is one test binary. Names of targets follow the folders: services/kinematics/core
# is the target `kinematics_core`, services/platform/bus is `platform_bus`.

find_package(Eigen3 REQUIRED)
find_package(GTest REQUIRED)
find_package(Threads REQUIRED)
# Here, at the root's scope, because imported targets are seen only in and below the folder that finds them.
find_package(absl REQUIRED)
find_package(Protobuf REQUIRED)
find_package(gRPC CONFIG REQUIRED)
find_package(fastcdr REQUIRED)
find_package(fastrtps REQUIRED)
find_package(prometheus-cpp CONFIG REQUIRED)
find_package(spdlog REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(OpenSSL REQUIRED)
find_package(SQLite3 REQUIRED)

find_program(CCACHE ccache)
if(CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

# A third of all building was linking; mold does it in a tenth of the time.
find_program(MOLD mold)
if(MOLD)
  add_link_options(-fuse-ld=mold)
endif()

set(LAMBDAJET_SANITIZE "" CACHE STRING "Sanitizers to build everything with, as in -fsanitize=…")
if(LAMBDAJET_SANITIZE)
  add_compile_options(-fsanitize=${LAMBDAJET_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${LAMBDAJET_SANITIZE})
endif()

# A file of gRPC, Fast DDS or GoogleTest spends most of its compiling on headers, so a whole build (deploy/build) joins the
# files of a door, a program or a check. The preset alone compiles each by itself: there a change costs one file.
option(LAMBDAJET_JOINED "Compile the files of a target joined (CMake's unity build)" OFF)
function(lambdajet_joined target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${LAMBDAJET_JOINED} UNITY_BUILD_BATCH_SIZE 8)
  if(LAMBDAJET_JOINED)
    # A class of a .cpp may hold what only that file knows; g++ sees the joined file and takes it for a header's.
    target_compile_options(${target} PRIVATE -Wno-subobject-linkage)
  endif()
endfunction()

# Every target of ours: warnings are errors; includes start at services/ and at the generated roots.
function(lambdajet_own_code target)
  # -Wno-restrict: g++ 12 reports its own std::string `"literal" + temporary` (GCC bug 105651); clang does not know it.
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wnon-virtual-dtor $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict> -Werror)
  target_include_directories(${target} PUBLIC ${CMAKE_SOURCE_DIR}/services)
endfunction()

# lambdajet_quiet_room(name SOURCES a.cpp … DEPS room …): computes; sees std, Eigen and other quiet rooms.
function(lambdajet_quiet_room name)
  cmake_parse_arguments(ROOM "" "" "SOURCES;DEPS" ${ARGN})
  if(ROOM_SOURCES)
    add_library(${name} STATIC ${ROOM_SOURCES})
    lambdajet_own_code(${name})
    target_link_libraries(${name} PUBLIC Eigen3::Eigen ${ROOM_DEPS})
  else()
    add_library(${name} INTERFACE)
    target_include_directories(${name} INTERFACE ${CMAKE_SOURCE_DIR}/services)
    target_link_libraries(${name} INTERFACE Eigen3::Eigen ${ROOM_DEPS})
  endif()
endfunction()

# lambdajet_door(name SOURCES … DEPS …): translates between a wire and a core, or wraps one library (platform).
function(lambdajet_door name)
  cmake_parse_arguments(ROOM "" "" "SOURCES;DEPS" ${ARGN})
  add_library(${name} STATIC ${ROOM_SOURCES})
  lambdajet_own_code(${name})
  lambdajet_joined(${name})
  target_link_libraries(${name} PUBLIC ${ROOM_DEPS})
endfunction()

# lambdajet_program(name SOURCES main.cpp DEPS …): one process; lands in <build>/bin.
function(lambdajet_program name)
  cmake_parse_arguments(PROGRAM "" "" "SOURCES;DEPS" ${ARGN})
  add_executable(${name}_program ${PROGRAM_SOURCES})
  lambdajet_own_code(${name}_program)
  lambdajet_joined(${name}_program)
  target_link_libraries(${name}_program PRIVATE ${PROGRAM_DEPS})
  set_target_properties(${name}_program PROPERTIES OUTPUT_NAME ${name} RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
endfunction()

# lambdajet_check(name LABELS unit SOURCES … DEPS … [TIMEOUT s] [SERIAL]): one GoogleTest binary, one ctest entry.
function(lambdajet_check name)
  cmake_parse_arguments(CHECK "SERIAL" "TIMEOUT" "SOURCES;DEPS;LABELS;ENVIRONMENT" ${ARGN})
  add_executable(${name} ${CHECK_SOURCES})
  lambdajet_own_code(${name})
  lambdajet_joined(${name})
  # A third off the time to compile a test (a precompiled header takes off half as much); laws count to a million.
  # At -O1 g++ inlines a test's own operator delete and not the new that goes with it, and finds them mismatched.
  if(NOT CHECK_LABELS MATCHES "laws|benchmark|fuzz")
    target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1> -Wno-mismatched-new-delete)
  endif()
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE GTest::gmock GTest::gtest_main ${CHECK_DEPS})
  add_test(NAME ${name} COMMAND ${name})
  if(NOT CHECK_TIMEOUT)
    set(CHECK_TIMEOUT 120)
  endif()
  set_tests_properties(${name} PROPERTIES LABELS "${CHECK_LABELS}" TIMEOUT ${CHECK_TIMEOUT}
    ENVIRONMENT "LAMBDAJET_SOURCE_DIR=${CMAKE_SOURCE_DIR};LAMBDAJET_BIN_DIR=${CMAKE_BINARY_DIR}/bin;${CHECK_ENVIRONMENT}")
  if(CHECK_SERIAL)
    set_tests_properties(${name} PROPERTIES RUN_SERIAL TRUE)
  endif()
endfunction()
