lambdajet_check(laws_trajectory_spatial LABELS laws TIMEOUT 300 SOURCES trajectory_spatial_test.cpp DEPS
                    trajectory_spatial trajectory_toolpath)
