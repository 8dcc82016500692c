# The way from Funcs to code.
retrograde_test(driver_test READS_FILES)
