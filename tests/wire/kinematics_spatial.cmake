lambdajet_check(wire_kinematics LABELS wire SOURCES kinematics_batches_test.cpp kinematics_hexapod_test.cpp
  DEPS kinematics_rpc)
