lambdajet_check(accuracy_inspection_bus_test LABELS bus SOURCES accuracy_inspection_bus_test.cpp DEPS
                    accuracy_bus inspection_bus platform_machine_file test_support)
