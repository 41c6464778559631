# 60 looks, 19 parameters: the house's identification beside plain Ceres with automatic derivatives in the same run.
add_executable(calibration_benchmark calibration_benchmark.cpp)
lambdajet_own_code(calibration_benchmark)
target_include_directories(calibration_benchmark PRIVATE ${CMAKE_SOURCE_DIR})
target_link_libraries(calibration_benchmark PRIVATE calibration_core)
