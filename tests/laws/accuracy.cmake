lambdajet_check(accuracy_laws_test LABELS laws SOURCES accuracy_laws_test.cpp DEPS accuracy_core)
