lambdajet_check(trajectory_rpc_test LABELS rpc
                SOURCES trajectory_rpc_test.cpp trajectory_spatial_rpc_test.cpp trajectory_bad_input_test.cpp
                DEPS trajectory_rpc platform_machine_file test_support TIMEOUT 180)
