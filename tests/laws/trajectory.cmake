lambdajet_check(laws_trajectory LABELS laws TIMEOUT 300 SOURCES trajectory_plan_test.cpp DEPS trajectory_core)
