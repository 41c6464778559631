lambdajet_check(accuracy_rpc_test LABELS rpc SOURCES accuracy_rpc_test.cpp DEPS accuracy_rpc
                    platform_machine_file test_support)
