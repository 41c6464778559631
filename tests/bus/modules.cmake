# Plays in real time: alone.
lambdajet_check(modules_loop_allocations_test LABELS bus SERIAL SOURCES modules_loop_allocations_test.cpp
  DEPS drive_bus main_motion_bus simulated_plant_bus simulated_plant_plant_file bus_cell virtual_cell test_support platform_machine_file)
