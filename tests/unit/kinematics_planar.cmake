lambdajet_check(unit_kinematics_workspace LABELS unit TIMEOUT 180
  SOURCES kinematics_workspace_test.cpp DEPS kinematics_core kinematics_optimisation)
# On its own: it replaces operator new of its whole program.
lambdajet_check(unit_kinematics_allocation LABELS unit SOURCES kinematics_allocation_test.cpp DEPS kinematics_core)
