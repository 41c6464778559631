lambdajet_check(calibration_core_test
  LABELS unit
  SOURCES calibration_identification_test.cpp calibration_measuring_plan_test.cpp
  DEPS calibration_core)
