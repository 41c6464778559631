# The real processes of a cell; added once all of them are built.
if(TARGET calibration_program AND TARGET trajectory_program AND TARGET drive_program AND TARGET main_motion_program)
  lambdajet_check(cell_cut_test LABELS system SOURCES cell_cut_test.cpp DEPS bus_cell test_support platform_rpc lambdajet_proto foundation_trouble
    TIMEOUT 600 SERIAL)
  add_dependencies(cell_cut_test cell_program calibration_program trajectory_program drive_program main_motion_program)
endif()
