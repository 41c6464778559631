lambdajet_check(calibration_identification_laws
  LABELS laws
  SOURCES calibration_identification_laws_test.cpp
  DEPS calibration_core
  TIMEOUT 300)
