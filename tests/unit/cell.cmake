lambdajet_check(cell_job_state_test LABELS unit SOURCES cell_job_state_test.cpp DEPS cell_core)
lambdajet_check(cell_conductor_test LABELS unit SOURCES cell_conductor_test.cpp DEPS cell_core)
lambdajet_check(cell_report_test LABELS unit SOURCES cell_report_test.cpp DEPS cell_core)
lambdajet_check(cell_journal_test LABELS unit SOURCES cell_journal_test.cpp DEPS cell_store)
