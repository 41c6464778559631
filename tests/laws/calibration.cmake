lambdajet_check(calibration_identification_laws
  LABELS laws
  SOURCES calibration_identification_laws_test.cpp
  DEPS calibration_core
  TIMEOUT 300)
lambdajet_check(calibration_virtual_cell_laws
  LABELS laws
  SOURCES calibration_virtual_cell_test.cpp
  DEPS calibration_core trajectory_core virtual_cell simulated_plant_plant_file platform_machine_file
  TIMEOUT 300)
