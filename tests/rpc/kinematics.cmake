lambdajet_check(rpc_kinematics LABELS rpc SOURCES kinematics_service_test.cpp
  DEPS kinematics_rpc platform_machine_file test_support)
