lambdajet_fuzz_target(gcode MUTATIONS 2000 DEPS trajectory_core)
