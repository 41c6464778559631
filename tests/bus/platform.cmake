lambdajet_check(platform_bus_test LABELS bus SOURCES platform_bus_test.cpp DEPS platform_bus test_support)
