lambdajet_check(main_job_laws_test LABELS laws SOURCES main_job_laws_test.cpp DEPS cut_trial
                    platform_machine_file simulated_plant_plant_file test_support TIMEOUT 300)
