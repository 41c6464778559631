lambdajet_check(laws_kinematics_planar LABELS laws TIMEOUT 300
  SOURCES kinematics_planar_round_trip_test.cpp kinematics_planar_jacobian_test.cpp
  DEPS kinematics_core)
