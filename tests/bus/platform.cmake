lambdajet_check(platform_bus_test LABELS bus SOURCES platform_bus_test.cpp DEPS platform_bus test_support)

# A house of its own for tests that need a second process.
lambdajet_program(test_house SOURCES test_house.cpp DEPS platform_house test_echo_proto)
target_include_directories(test_house_program PRIVATE ${CMAKE_SOURCE_DIR})
lambdajet_check(platform_house_test LABELS bus SOURCES platform_house_test.cpp DEPS platform_bus platform_rpc test_echo_proto test_support)
add_dependencies(platform_house_test test_house_program)
