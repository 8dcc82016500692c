# Parts of differentiation; test/gradient has the tests of derivatives.
retrograde_test(revolve_test LAYERS autodiff)
