lambdajet_check(laws_trajectory LABELS laws TIMEOUT 300 SOURCES trajectory_plan_test.cpp trajectory_hostile_test.cpp
                DEPS trajectory_core platform_machine_file)
lambdajet_check(laws_trajectory_tolerance LABELS laws TIMEOUT 300 SOURCES trajectory_tolerance_test.cpp
                DEPS trajectory_tolerance)
