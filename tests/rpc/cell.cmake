lambdajet_check(cell_rpc_test LABELS rpc SOURCES cell_rpc_test.cpp DEPS cell_rpc test_support TIMEOUT 180)
