lambdajet_check(
    inspection_rpc_test LABELS rpc SOURCES inspection_rpc_test.cpp DEPS inspection_rpc test_support)
