lambdajet_fuzz_target(cldata MUTATIONS 3000 DEPS trajectory_core)
